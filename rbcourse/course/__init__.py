"""The lessons as files: run, stored, shown to a class, and indexed by equation."""
