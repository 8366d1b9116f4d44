"""Design tasks as data; the model of a mechanism with its effects; its readings, samples and curves."""
