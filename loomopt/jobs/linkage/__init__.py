"""The linkage job, in the files every job has."""
