"""Problem sets: marking, handing out, collecting and grading."""
