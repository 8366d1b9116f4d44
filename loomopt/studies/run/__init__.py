"""How studies run: tasks, rows, workers, a durable store."""
