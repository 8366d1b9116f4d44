"""Results of studies, with their tables and charts."""
