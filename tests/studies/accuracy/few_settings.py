"""Settings of the accuracy study for tests."""

from loomopt.studies.accuracy import optima

SMALL = optima.Amount((1e-3, 1e-6, 1e-11), (12, 48), (1e-2, 1e-6, 1e-12), (8, 16, 32))
