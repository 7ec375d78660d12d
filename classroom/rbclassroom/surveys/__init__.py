"""Surveys of how near closed forms are to the optimum, such as the atlas of lesson 12."""
