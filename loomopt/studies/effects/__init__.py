"""Impact of every effect of a scene, and the effects that may be left out."""
