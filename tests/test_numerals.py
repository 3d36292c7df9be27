"""Numbers in text: plain decimals alone, wherever somebody wrote them."""

import pytest

from gpca.errors import InputError
from gpca.io.csv_file import finite_number
from gpca.numerals import decimal, in_decimals, whole
from gpca.seeds import seed_of_file

SLIPS = [
    "٣",
    "１",
    "0_0",
    "1_000",
    "0x10",
    "nan",
    "inf",
    "1e999",
    "",
    " ",
    "1 2",
    "1,5",
    "one",
    "−1",
    "9" * 5000 + "e",
    "1e",
]


@pytest.mark.parametrize("text", [*SLIPS, " 1", "1\n"])
def test_what_python_takes_for_a_number_or_nobody_does_is_refused(text):
    for read in (whole, decimal):
        with pytest.raises(ValueError, match="is not a"):
            read(text)


@pytest.mark.parametrize("text", ["0", "-0.5", ".5", "5.", "+1", "1e-05", "1E+20", "0.1234567890123456789"])
def test_decimals_are_read_as_they_stand(text):
    assert decimal(text) == float(text)


def test_whole_numbers_have_bounds():
    assert [whole("007"), whole("-2", -2), whole("1000000000")] == [7, -2, 10**9]
    for text in ("-1", "1000000001", "1.0", "+1", "9" * 5000):
        with pytest.raises(ValueError, match="is not a whole number from 0 to 1000000000"):
            whole(text)


@pytest.mark.parametrize("text", SLIPS)
def test_a_field_of_a_csv_file_is_a_plain_number(text):
    with pytest.raises(InputError, match=r"'value' is .*, not a finite number"):
        finite_number("numbers.csv", "value", text)


def test_the_name_of_a_file_tells_its_seed():
    assert seed_of_file("causes/mugs/seed12.npz") == 12
    for name in ("seed٣.npz", "seed1_0.npz", "12.npz", "seed.npz", "seed-1.npz"):
        with pytest.raises(InputError, match=r"is not named …/seed\{number\}\.npz; rename it"):
            seed_of_file(f"causes/mugs/{name}")


@pytest.mark.parametrize(
    ("value", "text"),
    [(1.3e-5, "0.000013"), (0.1, "0.1"), (2.0, "2"), (1234.5, "1200"), (0.0, "0"), (-0.0456, "-0.046")],
)
def test_lengths_have_no_exponent(value, text):
    assert in_decimals(value) == text
