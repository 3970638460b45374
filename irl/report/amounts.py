"""Numbers as a person reads them."""


def amount(value: float) -> str:
    """A reward or return with the digits a person reads: 3,477, 18.3, 0.39, 0.0031."""
    size = abs(value)
    return f"{value:,.{_digits(value)}f}" if size >= 0.1 else f"{value:.2g}"


def percent(share: float) -> str:
    """A share as a percentage: 0.953 -> 95 %."""
    return f"{100 * share:.0f} %"


def spread(mean: float, std: float | None) -> str:
    """Mean ± standard deviation, the latter to the digits of the mean and where it is known."""
    if std is None:
        return amount(mean)
    return f"{amount(mean)} ± {std:,.{_digits(mean)}f}" if abs(mean) >= 0.1 else f"{amount(mean)} ± {std:.2g}"


def _digits(value: float) -> int:
    return 0 if abs(value) >= 1000 else 1 if abs(value) >= 10 else 2
