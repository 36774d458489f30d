"""Parametric files: parameters with expressions, base files, repeated tables, and places in messages."""

import logging
import math

import pytest
import tomlkit

from cms.errors import CmsError
from fe_models.foundation.parametric_file import FUNCTIONS, extended_files, read_parametric
from fe_models.foundation.toml_file import line_numbers, value_of


@pytest.fixture
def read(tmp_path):
    """Return a function that reads a file of a given text."""

    def function(text, changes=None, **others):
        for name, content in others.items():
            (tmp_path / f"{name}.toml").write_text(content)
        (tmp_path / "file.toml").write_text(text)
        return read_parametric(tmp_path / "file.toml", CmsError, changes)

    return function


def test_expressions_have_the_values_of_python(read):
    text = """
    [parameters]
    length = 0.3
    width = "length / 15"
    turn = "radians(30)"
    rows = [1.0, "2 * width", 3]
    name = "'rod'"
    [body]
    mass = "{7850 * length * width**2}"
    x = ["{length * cos(turn)}", "{-length if width < 1 else 0}", "{rows[1]}"]
    count = "{floor(length / width)}"
    label = "{name} of {1e3 * length} mm, {{kept}}"
    """
    body = read(text)["body"]
    width = 0.3 / 15
    assert body["mass"] == 7850 * 0.3 * width**2
    assert body["x"] == [0.3 * math.cos(math.pi / 6), -0.3, 2 * width]
    assert (body["count"], type(body["count"])) == (15, int)
    assert body["label"] == "rod of 300 mm, {kept}"


def test_points_of_one_side_are_mirrored_to_the_other(read):
    text = """
    parameters.left = {pin = [1, 2, 3], ends = [[4, 5, 6], [7, -8, 9]]}
    [bodies.rod]
    pin = "{mirrored(left, -1).pin}"
    ends = "{mirrored(left, -1)['ends']}"
    same = "{mirrored(left.pin, 1)}"
    """
    rod = read(text)["bodies"]["rod"]
    assert rod == {"pin": [1, -2, 3], "ends": [[4, -5, 6], [7, 8, 9]], "same": [1, 2, 3]}


@pytest.mark.parametrize(
    "call", ["mirrored('left', 1)", "weighted([[1, 2], [3, 4, 5]], [1, 1])", "weighted([[1]], [])"]
)
def test_points_that_do_not_fit_are_refused(read, call):
    with pytest.raises(CmsError, match="cannot be evaluated"):
        read(f'[parameters]\np = "{call}"\n[a]\nx = "{{p}}"')


def test_a_file_without_parameters_keeps_its_braces(read):
    assert read('name = "{x}"')["name"] == "{x}"


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_every_function_can_be_called(read, name):
    argument = {"atan2": "0.3, 0.4", "hypot": "0.3, 0.4", "min": "0.3, 0.4", "max": "0.3, 0.4",
                "len": "[1, 2]", "sum": "[1, 2]", "range": "1, 3",
                "mirrored": "[1, 2, 3], -1", "weighted": "[[1, 2], [4, 5]], [-1, 2]"}.get(name, "0.5")  # fmt: skip
    expected = {"range": [1, 2], "len": 2, "sum": 3, "mirrored": [1, -2, 3], "weighted": [7, 8]}.get(
        name, FUNCTIONS[name](*eval(f"({argument},)"))
    )
    assert read(f'[parameters]\np = "{name}({argument})"\n[a]\nx = "{{p}}"')["a"]["x"] == expected


def test_values_from_outside_replace_parameters_before_they_are_used(read):
    text = '[parameters]\nlength = 0.3\narea = "length**2"\n[a]\nmass = "{area}"\nother = 1.0'
    assert read(text, {"length": 0.5, "a.other": 2.0})["a"] == {"mass": 0.25, "other": 2.0}
    assert value_of(read(text), "area", "file", CmsError) == 0.3**2


def test_a_base_file_is_merged_key_by_key(read):
    base = '[parameters]\nn = 2\n[run]\nh = "{n}"\nt_end = 1.0\n[bodies.a]\nmass = 1.0\n[bodies.b]\nmass = 2.0'
    content = read('extends = "base.toml"\nbodies.b = {}\n[parameters]\nn = 3\n[run]\nt_end = 5.0', base=base)
    assert content == {"run": {"h": 3, "t_end": 5.0}, "bodies": {"a": {"mass": 1.0}}}
    assert [path.name for path in content.files] == ["file.toml", "base.toml"]


def test_a_removed_key_may_be_missing_in_the_base_file(read):
    base = "[run]\nh = 1.0\n[bodies.a]\nmass = 1.0"
    upper = 'extends = "base.toml"\nfmu = {}\nbodies.b = {}\nsensors.tip = {}\nrun.watch = {}\n[bodies.c]\nmass = 2.0'
    content = read(upper, base=base)
    assert content == {"run": {"h": 1.0}, "bodies": {"a": {"mass": 1.0}, "c": {"mass": 2.0}}, "sensors": {}}


def test_all_files_that_a_file_extends_are_listed_although_they_give_nothing(read, tmp_path):
    read('extends = "upper.toml"\na = 1', upper='extends = "base.toml"\na = 2', base="a = 3")
    found = extended_files(tmp_path / "file.toml", CmsError)
    assert [path.name for path in found] == ["upper.toml", "base.toml"]


def test_files_named_by_a_base_in_another_folder_are_found(tmp_path):
    (tmp_path / "common").mkdir()
    (tmp_path / "common" / "rod.h5").write_text("")
    (tmp_path / "common" / "base.toml").write_text('file = "rod.h5"\nname = "rod.other"')
    (tmp_path / "file.toml").write_text('extends = "common/base.toml"')
    content = read_parametric(tmp_path / "file.toml", CmsError)
    assert content == {"file": str(tmp_path / "common" / "rod.h5"), "name": "rod.other"}


def test_repeat_copies_a_table_with_an_index(read):
    text = '[parameters]\nn = 3\n[bodies.link]\nrepeat = "{n}"\nmass = "{i * 1.5}"\nafter = "link{i - 1}"'
    assert read(text)["bodies"] == {
        "link1": {"mass": 1.5, "after": "link0"},
        "link2": {"mass": 3.0, "after": "link1"},
        "link3": {"mass": 4.5, "after": "link2"},
    }


def test_repeat_runs_over_products_and_rows(read):
    text = """
    [bodies."wheel_{axle}_{side}"]
    repeat = {axle = ["front", "rear"], side = [-1, 1]}
    y = "{side * 0.7}"
    [[rows]]
    repeat = [{name = "a", x = 1}, {name = "b", x = 2}]
    name = "{name}"
    inner = [{repeat = 2, x = "{10 * x + i}"}]
    """
    content = read(text)
    assert {name: body["y"] for name, body in content["bodies"].items()} == {
        "wheel_front_-1": -0.7, "wheel_front_1": 0.7, "wheel_rear_-1": -0.7, "wheel_rear_1": 0.7,
    }  # fmt: skip
    assert content["rows"] == [
        {"name": "a", "inner": [{"x": 11}, {"x": 12}]},
        {"name": "b", "inner": [{"x": 21}, {"x": 22}]},
    ]


def test_parameters_that_nothing_uses_are_reported(read, caplog):
    with caplog.at_level(logging.WARNING):
        read('[parameters]\na = 1\nb = 2\n[x]\ny = "{a}"')
    assert "parameters that nothing uses: b" in caplog.text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[parameters]\na = "b"\nb = "c"\nc = "a"', "use each other in a circle: a -> b -> c -> a (line 2)"),
        ('[parameters]\nlength = 1\n[x]\n\ny = "{lenght}"', "unknown name 'lenght'...did you mean 'length'...(line 5)"),
        ('[parameters]\na = "sqr(2)"', "unknown function 'sqr'...did you mean 'sqrt'"),
        ('[parameters]\na = "1 / 0"', "divides by zero (line 2)"),
        ('[parameters]\na = "1 +"', "not an expression (line 2)"),
        ('[parameters]\na = "sqrt(-1)"', "cannot be evaluated"),
        ('[parameters]\na = "1e308 * 10"', "expected a finite number"),
        ('[parameters]\na = "(1).__class__"', "cannot be evaluated"),
        ('[parameters]\na = "9**9**9"', "cannot be evaluated"),
        ("parameters = 3", "expected a table of names and values"),
        ("extends = 3", "expected a file name"),
        ('extends = "none.toml"', "none.toml: no such file"),
        ('extends = "file.toml"', "in a circle: file.toml extends file.toml"),
        ("[x.y]\nrepeat = -1", "expected a count, a table...got -1 (line 2)"),
        ("[x.y]\nrepeat = {i = true}", "expected a count or a list for each name"),
        ("[x.y]\nrepeat = [{a = 1}, {a = 2}]", "two copies are called 'y'"),
        ('[parameters]\na = "1e60"\n[x]\ny = "{2 * a * a}"', "x.y = ...: expected a number up to 1e+100 in size"),
        ("[x.y]\nrepeat = 1000000", "expected up to 20000 repeated tables"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_with_file_and_line(read, text, words):
    with pytest.raises(CmsError) as error:
        read(text)
    assert "file.toml" in str(error.value)
    assert all(part in str(error.value) for part in words.split("..."))


def test_an_unknown_parameter_from_outside_is_refused(read):
    with pytest.raises(CmsError, match="there is no parameter 'lenght'; did you mean 'length'"):
        read('[parameters]\nlength = 1\n[x]\ny = "{length}"', {"lenght": 2})


def test_an_expression_of_a_base_file_is_placed_in_that_file(read):
    with pytest.raises(CmsError, match=r"file.toml: x.y: unknown name 'b'.*\(base.toml, line 3\)"):
        read('extends = "base.toml"\n[parameters]\na = 1', base='\n[x]\ny = "{b}"')


def test_lines_are_those_of_keys_and_tables():
    text = 'a = 1\n\n[b."c.d"]\n# comment\ne = [\n  1,\n  2,\n]\nf.g = 2\n[[h]]\ni = 1\n[[h]]\nj = """\nx = 1\n"""\n'
    text += "[h.k]\nl = 3\n"
    assert line_numbers(text) == {
        ("a",): 1, ("b", "c.d"): 3, ("b", "c.d", "e"): 5, ("b", "c.d", "f"): 9, ("b", "c.d", "f", "g"): 9,
        ("h", 0): 10, ("h", 0, "i"): 11, ("h", 1): 12, ("h", 1, "j"): 13, ("h", 1, "k"): 16, ("h", 1, "k", "l"): 17,
    }  # fmt: skip


def test_the_resolved_file_describes_the_same(read, tmp_path):
    text = '[parameters]\nn = 3\n[bodies.link]\nrepeat = "{n}"\nmass = "{i / 3}"\n[[rows]]\nrepeat = 2\nx = "{i}"'
    content = read(text)
    (tmp_path / "shown.toml").write_text(tomlkit.dumps(dict(content)))
    assert read_parametric(tmp_path / "shown.toml", CmsError) == content
