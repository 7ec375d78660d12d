"""Settings of nbgrader for the problem sets, also for its own commands, typed in this folder.

They do not ask for a private set: that is ``--CourseDirectory.source_directory=private``.
"""

from rbclassroom.assignments.autograding import configure

c = get_config()  # noqa: F821 (nbgrader gives it)
configure(c)
