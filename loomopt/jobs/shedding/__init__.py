"""The shedding job, in the files every job has."""
