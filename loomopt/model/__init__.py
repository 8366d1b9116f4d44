"""What a design task is, as data; one model of a mechanism with its effects; readings, samples and curves of it."""
