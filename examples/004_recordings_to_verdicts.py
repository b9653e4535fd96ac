"""From a device's raw files to impacts, verdicts and the impacts table of a campaign.

Run: python examples/004_recordings_to_verdicts.py
"""

from __future__ import annotations

import tempfile

import forcemap as fm
from forcemap.lab.example_campaigns import simulate_example

folder = simulate_example("ur10e", tempfile.mkdtemp()).folder  # simulated; your own folder works the same
campaign = fm.read_campaign(folder)
print(f"{len(campaign.plan)} runs planned, {len(campaign.files())} files")

# one recording; campaign.columns is how the device writes its files, as [recordings] of campaign.toml states
file = campaign.recordings / "d890-h460-v400-r1.csv"
recording = fm.read_recording(file, columns=campaign.columns, device=campaign.conditions.device)
impact = fm.find_impact(recording)
print(f"{file.name}: {recording.samples} samples at {recording.sampling_rate:.0f} Hz")
print(f"contact from {impact.onset:.4f} s on, for {1000 * impact.contact_duration:.0f} ms: {impact.scenario.words}")
print(f"Phase I peak {impact.peak_force:.1f} N, largest sample {impact.raw_peak_force:.1f} N; flags: {impact.flags}")
print(f"Phase II at most {impact.phase2_force:.1f} N; no contact below {impact.floor:.1f} N")

# against the limits of a body area, under every interpretation of the standard
hand = fm.force_limit("back_of_hand")
verdict = fm.check_impact(impact, hand)
print(f"{verdict.outcome}: {fm.sentence(verdict.governing.reason)}")
for judgement in verdict.judgements:
    print(
        f"  {judgement.interpretation}: {judgement.outcome}, {judgement.force:.1f} N against {judgement.limit:g} N "
        f"{1000 * judgement.instant:.0f} ms after onset"
    )

# all of them: recordings.csv says what became of each, impacts.csv holds those that can be used
dataset = fm.build_dataset(campaign)
summary = fm.campaign_summary(fm.read_campaign(folder), dataset)
print(
    f"{summary.used} of {summary.recordings} recordings used, in {len(dataset.states)} states; flags: {summary.flags}"
)
print(fm.sentence(summary.phase_two.finding))

scatter = fm.repeatability(dataset)
print(f"standard deviation of repeats: {scatter.mean_sd:.1f} N on average, {scatter.max_sd:.1f} N at most")
for outlier in scatter.outliers:
    print(
        f"look at {outlier.recording}: {outlier.force:.1f} N, {outlier.deviation:+.1f} N from the others of its state"
    )
