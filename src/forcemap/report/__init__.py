"""The report of a campaign: an assessment as one self-contained HTML page, as a PDF, and what changed since."""

from forcemap.report.atlas_document import atlas_html
from forcemap.report.atlas_verification import AtlasVerification, verify_atlas
from forcemap.report.document import report_html
from forcemap.report.pdf import report_pdf
from forcemap.report.seal import (
    LIST_ENDING,
    PDF,
    REPORT_FILE,
    REPORT_MARK,
    MadeFor,
    Verification,
    altered,
    area_with_table,
    inputs_list,
    is_atlas_page,
    is_inputs_list,
    is_report,
    read_seal,
    verify_report,
)

__all__ = [
    "LIST_ENDING",
    "PDF",
    "REPORT_FILE",
    "REPORT_MARK",
    "AtlasVerification",
    "MadeFor",
    "Verification",
    "altered",
    "area_with_table",
    "atlas_html",
    "inputs_list",
    "is_atlas_page",
    "is_inputs_list",
    "is_report",
    "read_seal",
    "report_html",
    "report_pdf",
    "verify_atlas",
    "verify_report",
]
