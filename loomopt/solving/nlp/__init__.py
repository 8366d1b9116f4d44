"""From programs to nonlinear programs: scaling, whole-cycle rows, starts; no physics."""
