"""The rapier job, in the files every job has."""
