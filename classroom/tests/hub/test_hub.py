"""Run a JupyterHub: two users open lesson 00, and run lesson 06 by the hub's API."""

import asyncio
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import time
import uuid
from pathlib import Path
from urllib.parse import urlencode

import nbformat
import pytest
import yaml
from jupyter_client.jsonutil import json_default
from jupyter_client.session import Session
from jupyter_server.services.kernels.connection.base import deserialize_binary_message
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

ROOT = Path(__file__).parents[3]
CONFIG = """
import os, sys
c = get_config()
c.JupyterHub.authenticator_class = "dummy"
c.DummyAuthenticator.password = "rotation"
c.Authenticator.allow_all = True
c.JupyterHub.spawner_class = "simple"
c.SimpleLocalProcessSpawner.home_dir_template = os.path.join(os.getcwd(), "{username}")
c.Spawner.cmd = [sys.executable, "-m", "jupyterhub.singleuser"]
c.Spawner.args = ["--allow-root"]
c.Spawner.environment = {"PYTHONPATH": os.environ["PYTHONPATH"]}
c.Spawner.default_url = "DEFAULT"
c.Spawner.http_timeout = c.Spawner.start_timeout = 120
c.JupyterHub.load_roles = [{"name": "tester", "services": ["tester"],
    "scopes": ["admin:users", "admin:servers", "access:servers", "tokens"]}]
c.JupyterHub.services = [{"name": "tester", "api_token": "TOKEN"}]
c.JupyterHub.bind_url = "http://127.0.0.1:PORT"
c.JupyterHub.hub_port = HUB
c.ConfigurableHTTPProxy.api_url = "http://127.0.0.1:API"
c.ConfigurableHTTPProxy.command = ["PROXY"]
"""
VALUES = yaml.safe_load((ROOT / "classroom" / "hub" / "values.yaml").read_text("utf-8"))


def free_ports(count):
    found = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [each.getsockname()[1] for each in found]
    for each in found:
        each.close()
    return ports


@pytest.fixture(scope="module")
def hub(tmp_path_factory):
    """Start a hub whose users have the lessons; yield its address and an administrator's token."""
    if not shutil.which("npm"):
        pytest.skip("npm is needed, for configurable-http-proxy")
    folder = tmp_path_factory.mktemp("hub")
    site = folder / "site"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--target", site, "jupyterhub==6.*"]
    subprocess.run(pip, check=True)
    npm = ["npm", "install", "--no-fund", "--no-audit", "--prefix", folder]
    subprocess.run([*npm, "configurable-http-proxy"], check=True)
    port, inner, api = free_ports(3)
    proxy, token = folder / "node_modules/.bin/configurable-http-proxy", uuid.uuid4().hex
    url = VALUES["singleuser"]["defaultUrl"]
    replaced = {"PORT": port, "HUB": inner, "API": api, "PROXY": proxy, "TOKEN": token}
    text = CONFIG
    for name, value in {**replaced, "DEFAULT": url}.items():
        text = re.sub(rf"\b{name}\b", str(value), text)
    (folder / "jupyterhub_config.py").write_text(text)
    # Copy the lessons as the hook in values.yaml does.
    (command,) = [VALUES["singleuser"]["lifecycleHooks"]["postStart"]["exec"]["command"]]
    paths = os.pathsep.join(map(str, (site, ROOT, ROOT / "classroom")))
    env = {**os.environ, "PYTHONPATH": paths}
    for user in ("ada", "emmy"):
        (folder / user).mkdir()
        code = command[-1].replace("/srv/rbcourse", str(ROOT))
        own = {**env, "HOME": str(folder / user)}
        subprocess.run([sys.executable, "-c", code], check=True, env=own)
    with (folder / "log.txt").open("w") as log:
        words = [sys.executable, "-m", "jupyterhub"]
        job = subprocess.Popen(words, cwd=folder, env=env, stdout=log, stderr=log)
        yield f"http://127.0.0.1:{port}", token
        job.terminate()
        job.wait()
    print((folder / "log.txt").read_text()[-5000:])


async def answer(address, token="", method="GET", body=None, **more):
    """Return the answer of a server, as JSON; ask again while it starts."""
    client, until = AsyncHTTPClient(), time.monotonic() + 120
    headers = {"Authorization": f"token {token}"} if token else {}
    while True:
        try:
            request = HTTPRequest(address, method, headers, body=body, request_timeout=60, **more)
            found = await client.fetch(request)
            return json.loads(found.body or "null")
        except (HTTPClientError, OSError) as error:
            waiting = getattr(error, "code", 599) in (404, 424, 502, 503, 599)
            if time.monotonic() > until or not waiting:
                raise
            await asyncio.sleep(0.5)


async def run_cells(address, token, sources):
    """Run cells one after the other in a kernel; return the printed text of each, and errors."""
    kernel = await answer(f"{address}/api/kernels", token, "POST", "{}")
    channel = f"{address}/api/kernels/{kernel['id']}/channels".replace("http", "ws", 1)
    headers = {"Authorization": f"token {token}"}
    socket_ = await websocket_connect(HTTPRequest(channel, headers=headers), max_message_size=2**28)
    session, texts, errors = Session(), [], []
    for source in sources:
        request = {**session.msg("execute_request", {"code": source}), "channel": "shell"}
        await socket_.write_message(json.dumps(request, default=json_default))
        texts.append("")
        while True:
            raw = await socket_.read_message()
            message = deserialize_binary_message(raw) if isinstance(raw, bytes) else json.loads(raw)
            kind, content = message["header"]["msg_type"], message["content"]
            if message["parent_header"].get("msg_id") != request["msg_id"]:
                continue
            if kind == "stream":
                texts[-1] += content["text"]
            elif kind == "error":
                errors.append(content["evalue"])
            elif kind == "status" and content["execution_state"] == "idle":
                break
    socket_.close()
    return texts, errors


async def work(hub, token, user):
    """Log in, start a server, open lesson 00, and run lesson 06."""
    page = await AsyncHTTPClient().fetch(f"{hub}/hub/login")
    cookies = [each.partition(";")[0] for each in page.headers.get_list("Set-Cookie")]
    xsrf = next(each.partition("=")[2] for each in cookies if each.startswith("_xsrf="))
    form = urlencode({"username": user, "password": "rotation", "_xsrf": xsrf})
    headers = {"Cookie": "; ".join(cookies)}
    login = HTTPRequest(f"{hub}/hub/login?_xsrf={xsrf}", "POST", headers, form)
    login.follow_redirects = False
    with pytest.raises(HTTPClientError, match="302"):
        await AsyncHTTPClient().fetch(login)
    made = await answer(f"{hub}/hub/api/users/{user}/tokens", token, "POST", "{}")
    await answer(f"{hub}/hub/api/users/{user}/server", token, "POST", "{}")
    own, server = made["token"], f"{hub}/user/{user}"
    path = VALUES["singleuser"]["defaultUrl"].removeprefix("/lab/tree/")
    first = await answer(f"{server}/api/contents/{path}", own)
    assert first["content"]["cells"][0]["source"].startswith("# ")
    folder = path.rpartition("/")[0]
    lesson = await answer(f"{server}/api/contents/{folder}/06_geodesics.ipynb", own)
    cells = [cell for cell in lesson["content"]["cells"] if cell["cell_type"] == "code"]
    texts, errors = await run_cells(server, own, [cell["source"] for cell in cells])
    assert errors == []
    return texts


def test_two_users_run_lessons_at_the_same_time(hub):
    async def both():
        await answer(f"{hub[0]}/hub/api/", hub[1])
        return await asyncio.gather(*(work(*hub, user) for user in ("ada", "emmy")))

    stored = nbformat.read(ROOT / "notebooks" / "06_geodesics.ipynb", as_version=4)
    wanted = [
        "".join(each.text for each in cell.outputs if each.output_type == "stream")
        for cell in stored.cells
        if cell.cell_type == "code"
    ]
    for texts in asyncio.run(both()):
        assert texts == wanted
