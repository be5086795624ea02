import pytest

from app.server.access import Access, access_for
from tracker.errors import TrackerError

LOCAL = Access()
REMOTE = Access(frozenset({"lab.example.org"}), "secret")


@pytest.mark.parametrize(
    "host", ["localhost", "LOCALHOST:8080", "127.0.0.1:1", "127.9.9.9", "[::1]:8080", "localhost:65535"]
)
def test_loopback_names_pass_at_any_port(host):
    assert LOCAL.refusal(host, None) is None


@pytest.mark.parametrize(
    "host", [None, "", "evil.example", "localhost.evil.example", "x@localhost", "localhost:80:80", "192.168.0.3", "::1"]
)
def test_other_hosts_are_refused(host):
    assert "Host" in LOCAL.refusal(host, None)


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        ("localhost:9000", "http://localhost:9000"),
        ("localhost", "http://localhost:80"),
        ("localhost:443", "https://localhost"),
        ("[::1]:9", "http://[::1]:9"),
    ],
)
def test_own_origin_passes(host, origin):
    assert LOCAL.refusal(host, origin) is None


@pytest.mark.parametrize(
    "origin",
    [
        "null",
        "http://evil.example",
        "http://localhost:9001",
        "http://127.0.0.1:9000",
        "ftp://localhost:9000",
        "http://[",
    ],
)
def test_other_origins_are_refused(origin):
    assert origin in LOCAL.refusal("localhost:9000", origin)


def test_beyond_loopback_wants_name_and_token():
    assert REMOTE.refusal("lab.example.org:8080", None) is None
    assert REMOTE.role(["secret"]) == REMOTE.role(["guess", "secret"]) == "host"
    assert REMOTE.role(["guess"]) is REMOTE.role() is None
    assert "Host" in REMOTE.refusal("other.example.org:8080", None)


def test_shared_links_have_roles_tokens_and_paths_of_their_own():
    shared = access_for("127.0.0.1", share=True)
    tokens = [shared.token_of(role) for role in ("host", "annotate", "review", "look")]
    assert [shared.role([token]) for token in tokens] == ["host", "annotate", "review", "look"]
    assert len(set(shared.roots)) == len(set(tokens)) == 4
    assert shared.role([tokens[2] + "x"]) is None
    assert access_for("127.0.0.1", share=True).role([tokens[2]]) is None, "links end with their start"
    assert access_for("127.0.0.1").links == ()
    with pytest.raises(TrackerError, match="--share"):
        access_for("127.0.0.1", token=False, share=True)


def test_loopback_needs_a_token_unless_none_is_wanted():
    assert access_for("127.0.0.1").token
    assert access_for("127.0.0.1", token=False).token is None
    assert access_for("localhost", ["tunnel.example.org"]).hosts == {"tunnel.example.org"}


def test_access_beyond_loopback_makes_a_token_at_each_start():
    first, second = (access_for("0.0.0.0", ["Lab.Example.org"]) for _ in range(2))
    assert first.hosts == {"lab.example.org"}
    assert first.token
    assert second.token
    assert first.token != second.token
    assert first.cookie != second.cookie


def test_access_beyond_loopback_without_names_says_what_to_do():
    with pytest.raises(TrackerError, match=r"0\.0\.0\.0.*--allow-host"):
        access_for("0.0.0.0")


@pytest.mark.parametrize("name", ["http://lab", "lab:8080", "a b"])
def test_malformed_names_are_refused(name):
    with pytest.raises(TrackerError, match="host name without port"):
        access_for("0.0.0.0", [name])


def test_a_page_that_other_machines_reach_cannot_do_without_a_token():
    with pytest.raises(TrackerError, match="--no-token"):
        access_for("0.0.0.0", ["lab.example.org"], token=False)


@pytest.mark.parametrize("found", ["\xe9", "\ud800", "\x00", "\U0001f600", "secret\xe9"])
def test_any_text_can_be_compared_with_the_token(found):
    assert REMOTE.role([found]) is None


@pytest.mark.parametrize(
    ("host", "name"),
    [("localhost:8080", "8080"), ("localhost", "80"), ("[::1]", "80"), ("[::1]:9", "9"), ("a:b:c", "80")],
)
def test_the_cookie_has_the_port_that_the_page_is_called_by(host, name):
    assert REMOTE.cookie(host) == f"quadrille_{name}"


def test_the_root_is_not_to_be_guessed_and_stays_with_the_token():
    roots = {Access(token=token).root for token in ("secret", "other")}
    assert len(roots) == 2
    assert Access(token="secret").root in roots
    assert all(len(root) == 34 and "secret" not in root for root in roots)
    assert LOCAL.root == "/"
