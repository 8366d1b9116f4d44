"""The packaged scene that stands for a job in tests of every job: that of its name where there is one."""

SCENE_OF = {"linkage": "sixbar-sley"}


def scene_of(job):
    """Return the name of the job's packaged scene."""
    return SCENE_OF.get(job, job)
