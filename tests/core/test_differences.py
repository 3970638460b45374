from irl.core.differences import differences, without


def test_each_setting_that_differs_is_named_with_both_values() -> None:
    before = {"a": 1, "b": {"c": [1, 2], "d": None}, "gone": 3}
    now = {"a": 1, "b": {"c": [1, 3], "d": None}, "new": True}
    assert differences(before, now) == [
        "b.c was [1, 2] and is [1, 3]",
        "gone was 3 and is gone",
        "new is new: True",
    ]
    assert differences(before, before) == []


def test_another_kind_is_a_difference() -> None:
    assert differences({"learner": {"kind": "ppo"}}, {"learner": None}) == [
        "learner was {'kind': 'ppo'} and is None"
    ]


def test_some_settings_are_left_out() -> None:
    assert without({"a": 1, "b": 2}, ("b", "c")) == {"a": 1}
