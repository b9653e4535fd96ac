"""What to do where a table has too few states for a form: the file, and a form that would do."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from forcemap import (
    CFM_2D,
    CFM_3D,
    FitError,
    Form,
    RankDeficient,
    TooFewStates,
    fit_force_map,
    form_named,
    read_dataset,
)


@contextlib.contextmanager
def too_few_states_named(table: str, form: str | None) -> Iterator[None]:
    """Name the table, and a form that its states determine, in the refusal to fit it."""
    try:
        yield
    except (TooFewStates, RankDeficient) as error:
        wanted = form_named(form or CFM_3D.name)
        found, _, remedy = error.message.rpartition("; ")
        remedy = remedy.replace(", or choose", " or choose").replace(" or choose a form with fewer terms", "")
        message = f"{found} (form {wanted.name}); {remedy}{_other_form(table, wanted)}"
        raise type(error)(message, file=error.file or table) from None


def _other_form(table: str, wanted: Form) -> str:
    """The largest of the smaller forms that the states determine."""
    for form in (CFM_3D, CFM_2D):
        if len(form.terms) < len(wanted.terms):
            with contextlib.suppress(FitError):
                fit_force_map(read_dataset(table), form=form)
                knows = ", knows no height" if form == CFM_2D else ""
                return f", or use --form {form.name} ({len(form.terms)} coefficients{knows})"
    return ""
