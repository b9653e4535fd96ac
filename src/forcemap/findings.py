"""What a refusal, a reason, a warning or a statement is: a kind with its figures. Faces make the words."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

FindingKind = StrEnum(
    "FindingKind",
    # what a person or a file states: the one figure is a text
    "WORDS "
    # what is known of the speed at a place, in a zone, on a piece of a path
    "OUTSIDE UNCONFIRMED CAPPED ADMISSIBLE ZONE_OUTSIDE ZONE_UNCONFIRMED ZONE_CAPPED ZONE_ADMISSIBLE "
    "REACHED_AT_PLACE REACHED_IN_ZONE MEASURED_AT_PLACE MEASURED_IN_ZONE ALLOWANCE_SPENT NOT_ALONG "
    "CONTACT_EXCLUDED "
    # what forbids a limit, or raises the bound
    "NOT_PERMITTED TRANSIENT_NOT_USABLE CLAMPING SCENARIO_UNDETERMINED PHASE_TWO_ABOVE_LIMIT "
    "PHASE_TWO_ABOVE_PEAKS SPRING_OF_AREA_UNKNOWN SPRING_OF_DEVICE_NOT_STATED SPRING_TOO_SOFT SPRING_SOFTER "
    "SPRING_STIFFER SPRING_MEETS TEST_STATES_ABOVE LIMIT_NOT_CONFIRMABLE NOTHING_TO_CONFIRM NONE_CAN_BE_CONFIRMED "
    "RELEASE_NOTHING NO_SPEED_FOR_AREA CANNOT_TELL "
    # what must be said first
    "DEVICE_ALONE HEAD_BY_TABLE WEAK_BOUND_UNKNOWN WEAK_MARGIN WEAK_TOLERANCE WEAK_DEVICE_ERROR "
    "MARGIN_CONTRADICTED TOO_FEW_FOR_TOLERANCE TOLERANCE_EXCEEDS_MARGIN "
    # what a campaign states
    "SIMULATED ROBOT DIRECTION CONTACT_SITE TOOL SAFETY_SETTINGS SPEED_KIND LIMIT_TABLE CALIBRATION_EXPIRED "
    "PHASE_TWO PHASE_TWO_NOT_MEASURED "
    # what else a speed depends on
    "MAP_SOURCE LIMIT LIMIT_OF_AREA LIMIT_IN_NEWTONS BOUND ALONG_ONLY RAISED_OFF_AXIS PERSON_AT_REST "
    "PRESSURE_NOT_ASSESSED FALLS_WITH_SPEED DEVICE_RANGE_NOT_STATED DEVICE_ERROR_NOT_STATED "
    "PAPER_MARGIN_TOO_SMALL SCATTERED SATURATION_DOUBT NO_RESIDUALS CENSORED_NOT_IN_FIT CENSORED_IN_FIT "
    "WHOLE_ZONE ONLY_AS_MEASURED "
    # what speeds along a path depend on
    "AS_IN_CAMPAIGN MOTION_WITHIN RAISED_ON_PATH ALLOWANCE ACCELERATION STANDARD_MASSES PROGRAMMED_NOT_STATED "
    "PROGRAMMED_BY_TASK PROGRAMMED_BY_ROWS EXCLUDED_BY_TASK "
    # what comparisons depend on
    "CONTACT_MODEL FORMULA FORCES_COMPARED POSTURE MASS_PREDICTS_NOTHING "
    # what does not fit together in a campaign's folder
    "CONDITIONS_MISSING OWN_LIMITS_MISSING OWN_LIMITS_UNUSABLE OTHER_LIMITS OTHER_EDITION SATURATION_UNSEEN "
    "RECORDINGS_UNREADABLE RECORDINGS_NONE RECORDINGS_CHANGED RECORDINGS_GONE RECORDINGS_NEW TABLE_MISSING "
    "TABLE_UNOBTAINABLE TABLE_ROW_DIFFERS TABLE_LENGTH_DIFFERS SIMULATED_NOT_STATED "
    # what a recording shows of a limit
    "FORCE_EXCEEDS FORCE_NEAR_LIMIT FORCE_WITHIN FORCE_BEFORE_IMPACT NO_PEAK FLAGGED ENDS_EARLY LIMIT_UNNAMED "
    "EXCLUDED_BY_PERSON FILE_CHANGED FILE_GONE CURVE_GONE NO_CONTACT_PERMITTED "
    # what an impacts table is bound to
    "REGISTER_NOT_BESIDE BINDING_NOT_STATED IMPACTS_SELECTED UNUSED_NOT_TOLD REGISTER_UNUSABLE NOT_BOUND_YET "
    "REGISTER_EDITED TABLE_EDITED CONDITION_CHANGED RECORDING_CHANGED BINDING_BROKEN SPRING_NOT_STATED "
    "BINDING_OF BARRED DIMINISHES "
    # what new impacts say of a map, and what to do then
    "STATE_OF_MAP STATE_OUTSIDE_MAP PREDICTED_ABOVE_RANGE SPRING_SOFTER_THAN_MAPS FORCES_MOVED FORCES_MOVED_UNEVENLY "
    "STATES_MOVED NO_CHANGE NO_CHANGE_BUT TOO_FEW_UNCENSORED CHANGE_NOT_SHOWN CHANGE_HIDDEN_BY_CENSORED "
    "KNOWN_AT_LEAST STATES_CLOSE_TOGETHER MOST_LEFT_OUT KEEP_MAP MEND_AND_CHECK MEASURE_MORE_STATES "
    "MEASURE_CENSORED_STATES MEASURE_STATES_AGAIN MEASURE_NEW_MAP NEW_SPRING_NOT_STATED CHECKED_MAP "
    "ERROR_PROBABILITY SCATTER_AS_MAPS DEVICE_ERROR_NOT_TESTED FEWER_IMPACTS CENSORED_AT_LEAST "
    # how two maps, forms and terms compare
    "MAP_COMPARED WITHOUT_BOUNDS DIFFERS STATED_BY_ONE FORM_NOT_FITTED NO_FORM_CARRIES_BOUND NOTE_OF_FORM "
    "FORM_CLEARLY_BETTER FORM_KEPT FORM_COMPARED FORM_FALLS_ABOVE FORM_UNBOUNDED EUCLIDEAN_FORM NO_BOUND "
    "STATES_LEFT_OUT_IN_TURN FLATTERED WHOLLY_CENSORED WIDTH_OF_BOUND SELECTION_STABLE SELECTED_ON_ALL_ROLES "
    "CENSORED_NOT_USED P_VALUES_OVER_SAMPLES ONE_MAP_FOR_HEIGHTS MAP_PER_HEIGHT ONE_SPEED_FOR_WORKSPACE "
    # what a plan rests on, and what it will not give
    "EXPECTED_BY_MAP EXPECTED_BY_STANDARD EXPECTED_BY_FUNCTION EXPECTED_BY_STATES MAP_NAMED BEYOND_REACH "
    "EXPECTED_ABOVE_DEVICE STATES_CHOSEN FEW_STATES NO_BOUND_FROM_STATES FORM_NOT_DETERMINED EXPECTED_WIDTH "
    "RANGE_NOT_CHECKED LIMIT_NOT_CHECKED NO_RANGE_TO_CHECK NOT_EXPECTED_TO_CONFIRM SPEED_TO_ADD NO_SPEED_TO_ADD "
    "MAP_EXTRAPOLATES_BELOW MODEL_VANISHES_AT_REST STATES_SCATTER PREDICTION_FALLS "
    # what to measure next, and why to stop
    "UPPER_BY_EXPECTATION UPPER_BY_BOUND OPENING NO_BOUND_YET GAIN_OF_THESE GAIN_OF_MORE TOO_LITTLE_GAIN "
    "BUDGET_SPENT NONE_EXPECTED_WITHIN NO_BOUND_WITHIN EXPECTED_NOWHERE EXCEEDED_EVERYWHERE DEVICE_WAS_SATURATED "
    # whether impacts at released speeds confirm a map
    "CONFIRMING_RULE IMPACTS_PASSED IMPACTS_FAILED IMPACTS_CANNOT_TELL RUNS_MISSING RECORDING_NOT_CHECKED "
    "SLOWER_THAN_RELEASED NOT_WHERE_PLANNED ABOVE_BOUND BOUND_THERE DEVICE_RANGE_EXCEEDED FEWER_THAN_ASKED "
    "MEASURED_ABOVE_BOUND REPEATS_ALONE ",
)
"""What a finding says; the figures that go with a kind are named in its sentence (`words.toml`)."""


@dataclass(frozen=True)
class Finding:
    """Something that was established; equal by value, and hashable as long as its figures are.

    Parameters
    ----------
    kind : FindingKind
        What it says.
    figures : tuple of (str, value)
        Its numbers and names, units in the names.
    also : tuple of Finding
        What it consists of, or what else holds.

    Examples
    --------
    >>> found = Finding.of(FindingKind.TEST_STATES_ABOVE, count=6, states=6)
    >>> found.kind.value, found.figure("count")
    ('test_states_above', 6)
    """

    kind: FindingKind
    figures: tuple[tuple[str, Any], ...] = ()
    also: tuple[Finding, ...] = ()

    @classmethod
    def of(cls, kind: FindingKind, /, *also: Finding, **figures: Any) -> Finding:
        """A finding of a kind with what it consists of, and its figures by name."""
        return cls(kind, tuple(figures.items()), also)

    def figure(self, name: str) -> Any:
        """A figure by its name."""
        return dict(self.figures)[name]

    def and_(self, *others: Finding) -> Finding:
        """The same, and what else holds."""
        return Finding(self.kind, self.figures, (*self.also, *others))


def in_words(words: str) -> Finding:
    """A finding that a person or a file states in words."""
    return Finding.of(FindingKind.WORDS, words=words)
