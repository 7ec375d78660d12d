"""How near closed forms are to the optimum: the atlas of lesson 12."""
