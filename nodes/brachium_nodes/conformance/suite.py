"""One node from its start to its goodbye, and a verdict for every rule."""

from brachium_nodes.conformance import judging
from brachium_nodes.conformance.acts import ACTS, Play, door
from brachium_nodes.conformance.outage import goodbye, outage
from brachium_nodes.conformance.rules import NEEDS, RULES, Verdict, failed, not_claimed
from brachium_nodes.conformance.seeking import proof
from brachium_nodes.conformance.stage import Stage
from brachium_nodes.conformance.trial import Trial


def judge(trial: Trial, seek_port: int | None = None) -> list[Verdict]:
    """Try a node; return one verdict a rule, in the order of the table.

    `seek_port`: where a node that finds its gateway by itself asks for it; None: it does not.
    """
    stage = Stage()
    trial.port = stage.port
    play = Play(trial=trial, stage=stage)
    try:
        trial.start()
        if seek_port is not None:
            proof(play, seek_port)
        if not door(play):
            return _nobody_called(play.verdicts)
        caller = play.call(trial.patience.return_s)
        for act in (*ACTS, outage):
            if caller is None:
                break
            caller = act(play, caller)
        goodbye(play, caller)
    finally:
        trial.stop()
        stage.end()
    return _in_order([*play.verdicts, *judging.quiet(trial.quiet), *judging.over_all(play.heard, trial.node)])


def _nobody_called(verdicts: list[Verdict]) -> list[Verdict]:
    """Return one verdict a rule where there is nothing to judge by."""
    told = {verdict.rule: verdict for verdict in verdicts}
    return [told.get(rule) or not_claimed(rule, "cannot be told: nobody called") for rule in RULES]


def _in_order(verdicts: list[Verdict]) -> list[Verdict]:
    """Return one verdict a rule: the first that failed, else the first."""
    made = []
    for rule in RULES:
        mine = [verdict for verdict in verdicts if verdict.rule == rule]
        worst = next((verdict for verdict in mine if verdict.outcome == "failed"), None)
        if worst is None and mine:
            worst = mine[0]
        if worst is None and rule == "proof":
            worst = not_claimed(rule, "no port is given where it asks")
        made.append(worst or failed(rule, "the trial did not come so far"))
    broken = {verdict.rule for verdict in made if verdict.outcome == "failed"}
    return [_told(verdict, broken) for verdict in made]


def _told(verdict: Verdict, broken: set[str]) -> Verdict:
    """Leave a failure out that may come of another one alone."""
    causes = [cause for cause, rules in NEEDS.items() if cause in broken and verdict.rule in rules]
    if verdict.outcome != "failed" or not causes:
        return verdict
    return not_claimed(verdict.rule, f"cannot be told as long as {causes[0]!r} fails")
