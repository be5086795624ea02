"""How the page's modules and style sheets are joined."""

import pytest

from app.server.static_files import bundle_markup, bundle_script, bundle_styles, static_folder
from tracker.errors import TrackerError

FILES = {
    "main.js": (
        'import * as rooms from "./rooms/index.js";\nimport { first, second as other } from "./rooms/words.js";\n'
        'import { kept } from "./alone.js";\nsay(first, other, rooms.third(), kept);\n'
    ),
    "rooms/index.js": 'import {\n  second,\n} from "./words.js";\n\nexport function third() {}\n',
    "rooms/words.js": 'export const first = "a";\nexport const second = "b";\nconst other = "hidden";\n',
    "alone.js": 'export const kept = "k";\n',
}
JOINED = """// rooms/words.js
const $module2 = (() => {
const first = "a";
const second = "b";
const other = "hidden";
return { first, second };
})();
// rooms/index.js
const $module1 = (() => {
const {
  second,
} = $module2;

function third() {}
return { third };
})();
import * as $module3 from "./alone.js";
// main.js
const rooms = $module1;
const { first, second: other } = $module2;
const { kept } = $module3;
say(first, other, rooms.third(), kept);
"""


def test_modules_stand_once_after_what_they_import():
    assert bundle_script("main.js", FILES, ["alone.js"]) == JOINED


def test_a_module_that_the_page_loads_by_itself_keeps_its_exports():
    assert "export const kept" in bundle_script("alone.js", FILES)


def test_every_module_of_the_page_has_a_form_that_is_joined():
    folder = static_folder()
    files = {p.relative_to(folder).as_posix(): p.read_text("utf-8") for p in folder.rglob("*.js")}
    for path in files.keys() - {"main.js"}:
        entry = {"entry.js": f'import * as room from "./{path}";\n'}
        assert f"// {path}\n" in bundle_script("entry.js", files | entry)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('import "./rooms/words.js";\n', "import and export by name"),
        ("export default 3;\n", "import and export by name"),
        ('export { first } from "./rooms/words.js";\n', "import and export by name"),
        ('import { a } from "./nowhere.js";\n', "expected the page's file static/nowhere.js"),
        ('import * as rooms from "./rooms/index.js";\nimport { me } from "./main.js";\n', "break the cycle"),
    ],
)
def test_other_forms_are_refused(text, message):
    with pytest.raises(TrackerError, match=message):
        bundle_script("main.js", FILES | {"main.js": text})


def test_style_sheets_stand_where_they_are_imported():
    sheets = {
        "a/index.css": '/* all */\n@import url("b.css");\n@import url("../c.css");\n',
        "a/b.css": "b {}",
        "c.css": "c {}",
    }
    assert bundle_styles("a/index.css", sheets) == "/* all */\nb {}\nc {}\n"


def test_no_style_sheet_of_the_page_is_left_to_be_imported():
    folder = static_folder()
    sheets = {p.relative_to(folder).as_posix(): p.read_text("utf-8") for p in folder.rglob("*.css")}
    assert "@import" not in bundle_styles("styles/index.css", sheets)


def test_markup_of_rooms_stands_where_the_page_names_it():
    files = {"index.html": "<body>\n  <!-- a -->\n  <!-- r/b.html -->\n", "r/b.html": "<p>\n  <!-- r/c.html -->\n</p>"}
    assert bundle_markup("index.html", files | {"r/c.html": "<b>"}) == "<body>\n  <!-- a -->\n<p>\n<b>\n</p>\n"
    with pytest.raises(TrackerError, match=r"expected the page's file static/r/c.html"):
        bundle_markup("index.html", files)
