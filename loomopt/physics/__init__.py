"""Physics of looms: cycle, balance, mechanisms, effects and motions of their own; no scene and no solver."""
