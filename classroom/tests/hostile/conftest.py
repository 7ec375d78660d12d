import pytest
from packages import find_program
from tiny_class import make_template


def pytest_sessionstart(session):
    if not hasattr(session.config, "workerinput"):
        find_program("bubblewrap", "bwrap")


@pytest.fixture(scope="session")
def template(tmp_path_factory):
    return make_template(tmp_path_factory.mktemp("template"))
