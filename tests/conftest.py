"""One Hypothesis profile for every run: the same examples each time, no clock; "thorough" looks farther by hand.

pytest tests/properties --hypothesis-profile=thorough
"""

from hypothesis import settings

settings.register_profile("ci", derandomize=True, deadline=None, database=None, max_examples=100)
settings.register_profile("thorough", deadline=None, database=None, max_examples=2000)
settings.load_profile("ci")
