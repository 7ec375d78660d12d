from packages import find_program


def pytest_sessionstart(session):
    if not hasattr(session.config, "workerinput"):
        find_program("bubblewrap", "bwrap")
