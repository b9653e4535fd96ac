"""The page of a report as a PDF."""

from __future__ import annotations

from forcemap.errors import MissingExtra


def report_pdf(html: str) -> bytes:
    """A report's page as a PDF; nothing is fetched.

    Parameters
    ----------
    html : str
        The page, as `report_html` makes it.

    Raises
    ------
    MissingExtra
        weasyprint or a system library it needs is not installed.
    """
    try:
        from weasyprint import HTML
        from weasyprint.urls import URLFetcher
    except ImportError:
        raise MissingExtra(
            "a PDF needs weasyprint; install it from the project's folder: pip install '.[pdf]'"
        ) from None
    except OSError as error:
        raise MissingExtra(
            f"a PDF needs system libraries that weasyprint does not find ({str(error).splitlines()[0]}); on Debian or "
            "Ubuntu: apt install libpango-1.0-0 libpangoft2-1.0-0 libharfbuzz-subset0; or print the HTML file to PDF "
            "from a browser"
        ) from None
    fetcher = URLFetcher(allowed_protocols=("data",))
    return bytes(HTML(string=html, url_fetcher=fetcher).write_pdf())
