"""The report of a campaign: an assessment as one self-contained HTML page, as a PDF, and what changed since."""

from forcemap.report.atlas_document import atlas_html
from forcemap.report.document import report_html
from forcemap.report.pdf import report_pdf
from forcemap.report.seal import (
    LIST_ENDING,
    PDF,
    Verification,
    answers_for,
    area_made_for,
    inputs_list,
    is_inputs_list,
    made_for,
    read_seal,
    verify_report,
)

__all__ = [
    "LIST_ENDING",
    "PDF",
    "Verification",
    "answers_for",
    "area_made_for",
    "atlas_html",
    "inputs_list",
    "is_inputs_list",
    "made_for",
    "read_seal",
    "report_html",
    "report_pdf",
    "verify_report",
]
