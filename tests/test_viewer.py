"""Recordings in the browser: HTML files, notebooks, and the command ``skate-env view``."""

import base64
import contextlib
import html
import http.client
import io
import json
import re
import signal
import socket
import subprocess
import sys
import threading
from html.parser import HTMLParser

import numpy as np
import pytest
from typer.testing import CliRunner

from skate_env import IceSkateEnv, Policy, Simulator, load_scene
from skate_env.cli import app
from skate_env.policies import OrbitPolicy, inputs, shipped
from skate_env.replay import page as viewer
from skate_env.replay import record

# Elements without an end tag.
VOID = {"meta", "link", "input", "br", "img"}
PAGE = b"<!doctype html><title>page</title>"


@pytest.fixture(scope="module")
def skated():
    return record(Simulator("paper"), 3)


@pytest.fixture
def page(tmp_path, monkeypatch):
    """Put a small page in the place of the built one."""
    folder = tmp_path / "built"
    folder.mkdir()
    (folder / "index.html").write_bytes(PAGE)
    (folder / "engine.wasm").write_bytes(b"\0asm")
    (folder / "parts").mkdir()
    (folder / "parts/main.js").write_text("0")
    (folder / "player.html").write_text(
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>player</title></head>'
        '<body><script type="text/plain" id="recording">%RECORDING%</script></body></html>'
    )
    monkeypatch.setattr(viewer, "FOLDER", folder)
    return folder


@pytest.fixture
def no_page(tmp_path, monkeypatch):
    monkeypatch.setattr(viewer, "FOLDER", tmp_path / "missing")


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def unpacked(data):
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return dict(archive)


class Structure(HTMLParser):
    """Checks that elements are nested, and collects addresses."""

    def __init__(self, text):
        super().__init__()
        self.open, self.addresses = [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)
        self.addresses += [value for name, value in attrs if name in ("src", "href")]

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag


# --- the packed recording ------------------------------------------------------------------------


def test_the_packed_recording_is_the_recording_rounded_by_half_a_unit(skated):
    packed = unpacked(skated.packed())
    np.testing.assert_array_equal(packed["t"], skated.t)
    np.testing.assert_array_equal(packed["state_number"], skated.state_number)
    np.testing.assert_array_equal(packed["right_support"], skated.right_support)
    # Measured: 6.2e-5 m, 0.031 N; single precision adds 1e-6 m and 1e-4 N.
    assert abs(packed["segments"] - skated.segments).max() < 2.0**-14 + 2e-6
    assert abs(packed["head"] - skated.head).max() < 2.0**-14 + 2e-6
    assert abs(packed["contact_forces"] - skated.contact_forces).max() < 2.0**-5 + 1e-3
    metadata = json.loads(str(packed["metadata"]))
    assert metadata["scene"] == skated.metadata["scene"]
    assert metadata["fields"] == json.loads(skated.scene.to_json())
    assert metadata["policy"] is None and metadata["termination"] is None


def test_ten_seconds_take_less_than_a_quarter_of_a_megabyte():
    skated = record(Simulator("paper"), 28)
    # Measured: 136 kB for 9.64 s.
    assert len(skated.packed()) < 250e3 * skated.t[-1] / 10.0


def test_a_recording_longer_than_the_page_reads_is_refused(skated, monkeypatch):
    monkeypatch.setattr(viewer, "MOST_SAMPLES", 50)
    with pytest.raises(ValueError, match=f"{len(skated.t)} samples: the page shows at most 50"):
        skated.packed()


# --- HTML ----------------------------------------------------------------------------------------


def check_file(text):
    """Check a page with a recording; returns the recording's bytes."""
    assert Structure(text).addresses in ([], ["data:,"])
    assert not re.search(r"https?://|@import|url\(", text)
    inside = re.search(r'id="recording">([A-Za-z0-9+/=]+)<', text)
    return base64.b64decode(inside[1], validate=True)


def test_the_html_file_is_well_formed_and_holds_everything(skated, page):
    assert check_file(skated.to_html()) == skated.packed()


@pytest.mark.skipif(not viewer.FOLDER.exists(), reason="the page is not built: make web")
def test_so_is_that_of_the_built_page(skated):
    text = skated.to_html()
    assert check_file(text) == skated.packed()
    # Measured: 198 kB without the recording.
    assert len(text) - 4 / 3 * len(skated.packed()) < 250e3


def test_replay_writes_the_html_file(tmp_path, page):
    out = tmp_path / "out"
    result = run("replay", "--steps", 3, "--no-figures", "--html", "--out", out)
    assert result.exit_code == 0, result.output
    packed = unpacked(check_file((out / "recording.html").read_text()))
    assert len(packed["t"]) > 50
    assert {path.name for path in out.iterdir()} == {"steps.csv", "recording.npz", "recording.html"}


def test_without_the_page_replay_says_so_before_it_simulates(tmp_path, no_page):
    result = run("replay", "--steps", 1, "--html", "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert result.stderr.startswith("error: the page is not part of this installation")
    assert "make web" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_notebook_gets_the_player_in_a_frame(skated, page):
    shown = skated._repr_html_()
    Structure(shown)
    inside = re.fullmatch(r'<iframe style="[^"]*" srcdoc="([^"]*)"></iframe>', shown)
    assert html.unescape(inside[1]) == skated.to_html()


def test_a_notebook_without_the_page_gets_a_sentence(skated, no_page):
    shown = skated._repr_html_()
    Structure(shown)
    assert shown.startswith("<p>Recording of paper, 0.9") and "make web" in shown


# --- the server ----------------------------------------------------------------------------------


def ask(port, path, method="GET", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request(method, path, headers=headers)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer, content


def get(port, path):
    answer, content = ask(port, path)
    return answer.status, content


@pytest.fixture
def served(page):
    """Start a server with one more file in another thread."""
    with viewer.PageServer(file=("walk.npz", b"a walk")) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def test_the_server_gives_the_page_and_the_file_and_nothing_else(served, tmp_path, page, capfd):
    (tmp_path / "secret.txt").write_text("secret")
    for path, kind, wanted in (
        ("/", "text/html", PAGE),
        ("/?reload", "text/html", PAGE),
        ("/engine.wasm", "application/wasm", b"\0asm"),
        ("/parts/main.js", "text/javascript", b"0"),
        ("/walk.npz", "application/octet-stream", b"a walk"),
    ):
        for method in ("GET", "HEAD"):
            answer, content = ask(served.server_port, path, method)
            assert (answer.status, answer.headers["Content-Type"]) == (200, kind)
            assert answer.headers["Content-Length"] == str(len(wanted))
            assert content == (wanted if method == "GET" else b"")
    (page / "later.js").write_text("0")
    odd = ("/%00", "/%ff", "*", "/parts", "/parts/", "/later.js", "/#", "/\\")
    for path in ("/other.npz", "/../secret.txt", "/%2e%2e/secret.txt", "//etc/passwd", *odd):
        assert get(served.server_port, path)[0] == 404, path
    assert capfd.readouterr().err == ""


def test_the_server_answers_its_own_names_only(served):
    """The name of another page can be made to mean this machine (DNS rebinding)."""
    own = f"localhost:{served.server_port}"
    assert ask(served.server_port, "/walk.npz", Host=own)[1] == b"a walk"
    for host in ("example.com", f"example.com:{served.server_port}", "127.0.0.1.example.com", ""):
        answer, content = ask(served.server_port, "/walk.npz", Host=host)
        assert answer.status == 421 and b"a walk" not in content


def test_the_server_is_reached_from_this_machine_only(served):
    assert served.server_address[0] == "127.0.0.1"


def test_addresses_name_the_scene(served):
    port = served.server_port
    assert served.address({}) == f"http://127.0.0.1:{port}/"
    entries = {"scene": "a b.npz", "policy": "1"}
    assert served.address(entries) == f"http://127.0.0.1:{port}/#scene=a%20b.npz&policy=1"


# --- the command ---------------------------------------------------------------------------------


@pytest.fixture
def viewed(page, monkeypatch):
    """Run the command with a browser that reads the file, and is closed before it returns."""
    found = {}

    def visit(address):
        found["address"] = address.partition("#")[2]
        name = re.match("scene=([^&]*[.](npz|toml))", found["address"])
        port = int(re.search(r":(\d+)/", address)[1])
        _, found["file"] = get(port, f"/{name[1]}" if name else "/")
        found["server"].shutdown()

    class Server(viewer.PageServer):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            found["server"] = self

    monkeypatch.setattr("skate_env.replay.PageServer", Server)
    monkeypatch.setattr("webbrowser.open", visit)

    def view(*arguments):
        result = run("view", *arguments)
        assert result.exit_code == 0, result.output
        assert f"#{found['address']}" in result.stdout or not found["address"]
        return found["address"], found["file"]

    return view


def test_view_opens_the_page(viewed):
    assert viewed() == ("", PAGE)
    assert viewed("--scene", "paper_arms") == ("scene=paper_arms", PAGE)


def test_view_opens_a_recording(viewed, skated, tmp_path):
    skated.save(tmp_path / "my walk.npz")
    address, file = viewed(tmp_path / "my walk.npz")
    assert address == "scene=my_walk.npz"
    assert file == skated.packed()


def test_view_opens_a_scene_from_a_file(viewed, tmp_path):
    scene = load_scene("paper").without("arms")
    (tmp_path / "mine.toml").write_text(scene.to_toml())
    address, file = viewed("--scene", tmp_path / "mine.toml")
    assert address == "scene=paper.toml"
    assert file.decode() == scene.to_toml()


def test_view_opens_a_policy_on_its_scene_or_on_another(viewed, tmp_path):
    own = Policy.load(shipped("paper_printed"))
    for arguments, scene in ((), own.scene), (("--scene", "push_only"), load_scene("push_only")):
        address, file = viewed("--policy", shipped("paper_printed"), *arguments)
        assert address == "scene=paper_printed.npz&policy=1"
        (tmp_path / "served.npz").write_bytes(file)
        served = Policy.load(tmp_path / "served.npz")
        assert served.scene == scene
        np.testing.assert_array_equal(served.layers[0][0], own.layers[0][0])
    address, _ = viewed("--policy", "shipped", "--scene", "push_only")
    assert address == "scene=push_only.npz&policy=1"


def test_view_refuses_a_feedback_about_an_orbit(page, tmp_path):
    """The page has no code for it."""
    env = IceSkateEnv("push_only", joints="all", mirrored=False)
    d, n = len(inputs(env.observation_names)), len(env.joint_names)
    OrbitPolicy(
        scene=load_scene("push_only"),
        references=np.zeros((1, d)),
        actions=np.zeros((1, n)),
        gains=np.zeros((1, n, d)),
        roots=np.zeros((1, d, d)),
        limit=1.0,
        action_scale=dict.fromkeys(env.joint_names, 1.0),
        observation_names=env.observation_names,
        joint_names=env.joint_names,
        about={},
    ).save(tmp_path / "feedback.npz")
    result = run("view", "--no-open", "--policy", tmp_path / "feedback.npz")
    assert result.exit_code == 2
    assert "the page runs learned policies only" in result.stderr


def damaged(data):
    bent = bytearray(data)
    bent[len(bent) // 2] ^= 1
    return {"bent": bytes(bent), "short": data[: len(data) // 2], "empty": b"", "text": b"no walk"}


def test_damaged_recordings_are_one_clear_line(skated, tmp_path, page):
    skated.save(tmp_path / "walk.npz")
    for name, data in damaged((tmp_path / "walk.npz").read_bytes()).items():
        (tmp_path / f"{name}.npz").write_bytes(data)
        result = run("view", "--no-open", tmp_path / f"{name}.npz")
        assert result.exit_code == 2
        assert re.fullmatch(rf"error: recording .*{name}\.npz: .+\n", result.stderr), result.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["missing.npz"], "missing.npz"),
        (["--scene", "moon"], "moon"),
        (["--policy", "missing.npz"], "missing.npz"),
        (["walk.npz", "--scene", "paper"], "do not apply to a recording"),
        (["--scene", "paper_arms", "--policy", "shipped"], "no policy for the scene 'paper_arms'"),
        (["--port", "70000"], "65535"),
    ],
)
def test_mistakes_are_named(page, arguments, said):
    result = run("view", "--no-open", *arguments)
    assert result.exit_code == 2
    assert said in result.stderr.strip().splitlines()[-1]
    assert "Traceback" not in result.output


def test_a_port_in_use_is_an_error(page):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        result = run("view", "--no-open", "--port", taken.getsockname()[1])
    assert result.exit_code == 2
    assert result.stderr.startswith("error: ")


def test_without_the_page_view_says_how_to_get_it(no_page):
    result = run("view", "--no-open")
    assert result.exit_code == 2
    assert "make web" in result.stderr


@contextlib.contextmanager
def ending(process):
    """End a process that an exception leaves running."""
    try:
        yield
    finally:
        process.kill()


@pytest.mark.skipif(not viewer.FOLDER.exists(), reason="the page is not built: make web")
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 0), (signal.SIGTERM, 143)])
def test_the_command_serves_until_a_signal_ends_it(number, status):
    command = [sys.executable, "-m", "skate_env", "view", "--no-open", "--scene", "paper"]
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as it,
        ending(it),
    ):
        address = it.stdout.readline()
        port = int(re.fullmatch(r"http://127\.0\.0\.1:(\d+)/#scene=paper\n", address)[1])
        assert it.stdout.readline() == "Ctrl-C ends the server.\n"
        assert get(port, "/")[1].startswith(b"<!doctype html>")
        assert get(port, "/engine.wasm")[1].startswith(b"\0asm")
        it.send_signal(number)
        assert it.wait(timeout=20) == status
        assert it.stderr.read() == ""
