"""The keys of the page, read from the user's file and written to it."""

import json

import pytest
from serving import page_of

from app.server.key_routes import KEYS_FILE, KeyRoutes

LINE = '"Track forward" = ['


@pytest.fixture
def path(tmp_path):
    return tmp_path / "state" / KEYS_FILE


@pytest.fixture
async def client(path):
    async with page_of(KeyRoutes(path.parent, has_token=True)) as page:
        yield page


async def test_keys_that_are_changed_are_read_and_other_lines_stay(client, path):
    assert json.loads((await client.get("/keys"))[1]) == {"file": str(path), "keys": {}}
    assert (await client.post("/keys", {"Track forward": ["G"], "Fit to pins and edges": []}))[0] == 200
    assert path.stat().st_mode & 0o777 == 0o600
    assert [each.name for each in path.parent.iterdir()] == [KEYS_FILE]
    unread = "Sideways = 3\nSince = 2026-01-01\n"
    path.write_text(path.read_text() + unread)
    assert (await client.post("/keys", {"Track forward": None, "Curves": ["V"]}))[0] == 200
    keys = json.loads((await client.get("/keys"))[1])["keys"]
    assert keys == {"Fit to pins and edges": [], "Sideways": 3, "Since": "2026-01-01", "Curves": ["V"]}
    assert unread in path.read_text()


async def test_a_file_that_is_no_toml_is_named_and_kept(client, path):
    path.parent.mkdir()
    path.write_text(LINE)
    status, why = await client.get("/keys")
    assert (status, str(path) in why) == (400, True)
    assert (await client.post("/keys", {}))[0] == 400
    assert path.read_text() == LINE


@pytest.mark.parametrize("body", [[], {"a": "T"}, {"a": [1]}, {"a": ["T"] * 11}, {"a" * 201: []}, {"\ud800": ["T"]}])
async def test_another_body_is_refused(client, path, body):
    assert (await client.post("/keys", body))[0] == 400
    assert not path.exists()


async def test_only_the_user_changes_keys(client, path):
    assert (await client.post("/keys", {}, **{"Sec-Fetch-Site": "cross-site"}))[0] == 403
    assert (await client.post("/keys", {}, **{"Content-Type": "text/plain"}))[0] == 403
    assert (await client.get("/keys", **{"Sec-Fetch-Site": "same-site"}))[0] == 403
    client.session.cookie_jar.clear()
    assert (await client.post("/keys", {}))[0] == 403
    async with page_of(KeyRoutes(path.parent, has_token=False)) as public:  # other accounts reach it, too
        status, why = await public.post("/keys", {"Track forward": ["G"]})
        assert (status, str(path) in why) == (403, True)
    assert not path.exists()
