"""One recording of a campaign: its curve, its impacts and their verdicts."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

import forcemap as fm
from forcemap.answers.answer import Answer
from forcemap.answers.check import CheckAnswer
from forcemap.verdicts.recording_results import recording_doubt
from forcemap.web.campaign_answers import RecordingLine, problem_words, recording_line
from forcemap.web.judgements import MeasuredAnswer, read_answer
from forcemap.web.limits import Limits
from forcemap.web.question import Area
from forcemap.web.request_error import RequestError


class RecordingQuestion(Area):
    """A question about one recording."""

    recording: str = Field(description="Its name in the register: its file, and # and its curve.", max_length=600)


class RecordingAnswer(Answer):
    """A recording: what became of it, its verdicts with its curve, or why there are none; its neighbours by name."""

    registered: RecordingLine
    excluded: str
    judgement: CheckAnswer | MeasuredAnswer | None
    problem: str
    before: str
    after: str


def recording_answer(folder: Path, question: RecordingQuestion, limits: Limits) -> RecordingAnswer:
    """A recording of a campaign, read and judged again.

    Raises
    ------
    RequestError
        The register has no recording of that name.
    """
    campaign = fm.read_campaign(folder)
    names = [entry.name for entry in campaign.entries]
    if question.recording not in names:
        message = f"no recording is named {question.recording!r}; the campaign's page lists them"
        raise RequestError(404, "not_found", message)
    at = names.index(question.recording)
    entry, judgement, problem = campaign.entries[at], None, ""
    path = campaign.recordings / entry.file
    try:
        if entry.file not in campaign.files():
            raise fm.InputError("there is no such file any more", file=entry.file)
        doubt = recording_doubt(folder, path)
        judgement = read_answer(path, entry.file, folder, question, limits, curve=entry.name, doubt=doubt, drawn=True)
    except fm.ForcemapError as error:
        problem = problem_words(error)
    return RecordingAnswer(
        registered=recording_line(entry),
        excluded=entry.exclude,
        judgement=judgement,
        problem=problem,
        before=names[at - 1] if at else "",
        after=names[at + 1] if at + 1 < len(names) else "",
    )
