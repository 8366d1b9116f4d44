"""The beatup job, in the files every job has."""
