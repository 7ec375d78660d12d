"""Settings for nbgrader; nbgrader's own commands read them in this folder.

For a private set, add ``--CourseDirectory.source_directory=private`` to these commands.
"""

from rbclassroom.assignments.autograding import configure

c = get_config()  # noqa: F821 (nbgrader gives it)
configure(c)
