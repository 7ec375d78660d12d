"""The outputs of a cell are cut where they are made."""

from rbcourse.assignments.quota import limited


def sent(messages, shown=10):
    """What is sent of messages, each a type and a content."""
    out = []
    send = limited(lambda stream, kind, content=None, **more: out.append((kind, content)), shown)
    for kind, content in messages:
        send(None, kind, content)
    return out


def test_a_stream_is_cut_and_what_follows_is_dropped():
    begin, line = ("execute_input", {"code": "x" * 99}), ("stream", {"name": "a", "text": "y" * 30})
    out = sent([begin, line, line, begin, ("stream", {"text": "short"})])
    assert [kind for kind, _ in out] == ["execute_input", "stream", "execute_input", "stream"]
    assert out[1][1]["text"].startswith("y" * 10 + "[output cut: ")
    assert out[3][1] == {"text": "short"}


def test_where_a_stream_goes_is_kept_and_the_limit_is_told():
    lines = [("stream", {"name": "stdout", "text": text}) for text in ("y" * 20, "z" * 9)]
    text = "zzzz[output cut: more than 30 characters]\n"
    assert sent(lines, 30)[1][1] == {"name": "stdout", "text": text}


def test_half_a_page_is_not_shown():
    ((_, content),) = sent([("display_data", {"data": {"text/html": "<p>" * 99}, "metadata": {}})])
    assert list(content["data"]) == ["text/plain"]
    assert "[output cut: " in content["data"]["text/plain"]


def test_a_picture_is_larger_than_what_one_prints():
    picture = {"data": {"image/png": "P" * 199, "text/plain": ""}, "metadata": {}}
    assert sent([("display_data", picture)]) == [("display_data", picture)]


def test_an_error_and_a_reply_come_shortened_whatever_was_printed():
    flood = ("stream", {"text": "z" * 99})
    error = {"ename": "E", "evalue": "w" * 5000, "traceback": ["v" * 5000]}
    out = sent([flood, flood, ("error", error), ("execute_reply", error), ("status", {})])
    assert [kind for kind, _ in out] == ["stream", "error", "execute_reply", "status"]
    assert all(len(content["evalue"]) < 2100 for _, content in out[1:3])
    assert len(out[1][1]["traceback"][0]) < 2100
