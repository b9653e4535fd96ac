"""Who is let in: nothing is answered without the token, and nobody keeps the door open with half a request."""

from __future__ import annotations

import re
import signal
import socket
from contextlib import ExitStack
from http.cookies import SimpleCookie
from urllib.parse import urlsplit

import httpx
import pytest

import forcemap as fm
from forcemap.web.admission import new_token
from web_server import PATIENCE, TOKEN, bearer, client_of, serving

ADDRESSES = [
    "/", "/campaigns/kuka", "/campaigns/kuka/speeds?distance_m=0.8", "/campaigns/nothing", "/nothing", "/favicon.ico",
    "/api", "/api/campaigns", "/api/campaigns/kuka/map", "/api/campaigns/kuka/files/map.json", "/api/openapi.json",
    "/static/page.css", "/static/nothing", "/static/look.js",
]  # fmt: skip
WRONG = ["", "wrong", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), "t\u00f6ken"]


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    root = tmp_path_factory.mktemp("served")
    fm.copy_example("kuka-iiwa7-30nm", root / "kuka")
    return root


@pytest.fixture(scope="module")
def client(root):
    with client_of(root) as client:
        yield client


@pytest.fixture
def stranger(client):
    """A client that was told nothing."""
    options = {"timeout": PATIENCE, "trust_env": False, "base_url": client.base_url}
    with httpx.Client(**options) as stranger:
        yield stranger


def refused(answer, address):
    assert answer.status_code == 401
    assert answer.headers["www-authenticate"] == "Bearer"
    assert "set-cookie" not in answer.headers
    assert "frame-ancestors 'none'" in answer.headers["content-security-policy"]
    assert TOKEN not in answer.text + str(answer.headers)
    assert "kuka" not in answer.text.replace(address.partition("?")[0], "")


@pytest.mark.parametrize("address", ADDRESSES)
def test_no_answer_without_the_token(client, stranger, address):
    for method in ("GET", "HEAD", "POST", "PUT", "OPTIONS"):
        refused(stranger.request(method, address), address)
    assert "pen the address that forcemap serve printed" in stranger.get(address).text
    assert client.get(address).status_code in (200, 404)


@pytest.mark.parametrize("address", ["/", "/campaigns/kuka", "/api/campaigns", "/static/page.css"])
def test_nothing_but_the_token_opens(client, stranger, address):
    port = client.base_url.port
    headers = [{"authorization": f"Bearer {wrong}".strip().encode()} for wrong in WRONG]
    headers += [{"authorization": how} for how in (TOKEN, f"Basic {TOKEN}", f"token={TOKEN}", f"Bearer {TOKEN} x")]
    headers += [{"cookie": f"{name}={TOKEN}"} for name in (f"forcemap-{port}", "forcemap", "token")]
    for each in headers:
        refused(stranger.get(address, headers=each), address)
    for wrong in WRONG:
        refused(stranger.get(f"{address}?token={wrong}"), address)


def test_the_address_gives_a_cookie_and_goes_away(client, stranger):
    for address in ("/", "/campaigns/kuka/speeds?distance_m=0.8&area=chest"):
        more = "&" if "?" in address else "?"
        opened = stranger.get(f"{address}{more}token={TOKEN}")
        assert (opened.status_code, opened.headers["location"], opened.text) == (
            303,
            address,
            "",
        )
        assert TOKEN not in str(opened.headers)
        (cookie,) = SimpleCookie(opened.headers["set-cookie"]).values()
        assert cookie.key == f"forcemap-{client.base_url.port}"
        assert (cookie["httponly"], cookie["samesite"], cookie["path"], cookie["max-age"]) == (True, "strict", "/", "")
        assert stranger.get(address).status_code == 200
    for address in ADDRESSES:
        assert stranger.get(address).status_code in (200, 404)
    assert stranger.get("/?token=old").headers["location"] == "/"
    assert stranger.get("/api/campaigns").status_code == 200


def test_an_address_of_the_api_opens_nothing(client, stranger):
    for address in (
        "/api/campaigns?token={}",
        "/static/page.css?token={}",
        "/nothing?token={}",
        "/campaigns/{}",
        "/{}",
    ):
        for asking in (stranger, client):
            for token in (TOKEN, TOKEN.replace("-", "%2D")):
                answer = asking.get(address.format(token))
                assert answer.status_code == 401
                assert TOKEN not in answer.text + str(answer.headers)
    assert stranger.post(f"/?token={TOKEN}").status_code == 401


def test_host_and_origin_are_judged_first(stranger):
    """The token opens nothing to another site."""
    link = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}
    assert stranger.get(f"/?token={TOKEN}", headers={"host": "evil.example"}).status_code == 421
    for headers in (
        {"origin": "http://evil.example"},
        {"sec-fetch-site": "cross-site"},
        link | {"sec-fetch-dest": "iframe"},
    ):
        assert stranger.get(f"/?token={TOKEN}", headers=headers).status_code == 403
        assert stranger.get("/api/campaigns", headers=headers | bearer(TOKEN)).status_code == 403
    assert stranger.get(f"/?token={TOKEN}", headers=link).status_code == 303


def test_each_start_has_a_token_of_its_own_that_nothing_repeats(root):
    assert new_token() != new_token()
    with serving(root) as (process, address, token):
        assert re.fullmatch(r"[\w-]{43}", token)
        for path in ("/", "/api/campaigns", "/nothing", "/campaigns/kuka/speeds?distance_m=far"):
            for headers in ({}, bearer(token), bearer("wrong")):
                answer = httpx.get(f"{address}{path}", headers=headers, timeout=PATIENCE, trust_env=False)
                assert token not in answer.text + str(answer.headers)
        for path in (f"/?token={token}", f"/api/campaigns?token={token}", f"/campaigns/{token}"):
            assert httpx.get(f"{address}{path}", timeout=PATIENCE, trust_env=False).status_code in (303, 401)
        with socket.create_connection((urlsplit(address).hostname, urlsplit(address).port)) as nonsense:
            nonsense.sendall(f"GET /?token={token} nonsense\r\n\r\n".encode())
            assert token.encode() not in nonsense.recv(1000)
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0
        assert process.stderr.read() == ""


def test_half_requests_do_not_keep_others_out(client):
    """Each is closed in time, and of very many the one that waits longest goes first."""
    where = (client.base_url.host, client.base_url.port)
    with ExitStack() as stack:

        def half(head):
            connection = stack.enter_context(socket.create_connection(where, timeout=PATIENCE))
            connection.sendall(head)
            return connection

        many = [half(b"GET / HTTP/1.1\r\nhost: 127.0.0.1\r\nx-slow: ") for _ in range(600)]
        options = {
            "headers": bearer(TOKEN),
            "timeout": PATIENCE,
            "trust_env": False,
        }  # kept alive, it would wait longest
        assert httpx.get(f"{client.base_url}/api/campaigns", **options).status_code == 200
        assert ended(many[0])
        whole = b"GET /api HTTP/1.1\r\nhost: 127.0.0.1\r\n\r\n"
        again = half(whole + b"GET / HTTP/1.1\r\n")
        assert again.recv(100).startswith(b"HTTP/1.1 401")
        for connection in (
            many[-1],
            again,
            half(b""),
            half(b"POST /api HTTP/1.1\r\nhost: 127.0.0.1\r\ncontent-length: 9\r\n\r\n1"),
        ):
            assert ended(connection)
    assert httpx.get(f"{client.base_url}/api/campaigns", **options).status_code == 200


def ended(connection):
    """Whether the server ends a connection; it says nothing but a refusal before."""
    try:
        while connection.recv(1000):
            pass
    except ConnectionResetError:
        pass
    return True
