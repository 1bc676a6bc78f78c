"""Effects removed from the library: evenly chosen, and unknown if all goes well."""

from pathlib import Path

from clie_blocks.analysis.blind.comparison.leave_one_out import score_left_out, select_trials
from clie_blocks.analysis.blind.report.page import save_page
from clie_blocks.analysis.blind.scoring.score import score


def test_an_effect_removed_from_the_library_should_be_unknown(tmp_path, plain_study):
    found = score_left_out({"single": plain_study.answer("unknown")}, plain_study.labels)
    assert found["left_out_unknown"]["rate"] == 1 and found["left_out_none"]["rate"] == 0
    relative = score_left_out({"single": plain_study.answer("stribeck")}, plain_study.labels)
    assert relative["left_out_family"]["rate"] == 1 and relative["left_out_unknown"]["rate"] == 0
    board = plain_study.board(score(plain_study.right_answers, plain_study.labels)) | relative
    page = Path(save_page(board, tmp_path)).read_text()
    assert "Each effect removed from the library" in page


def test_effects_are_left_out_evenly_over_the_seeds(plain_study):
    labels = {seed: {f"{effect}-{i}": plain_study.label("single") | {"labels": [effect]}
                     for effect in ("coulomb", "spring", "encoder_quantization") for i in range(3)}
              for seed in (51, 52, 53)}
    found = select_trials(labels, 2)
    assert found == {"coulomb": [(51, "coulomb-0"), (52, "coulomb-0")],
                     "spring": [(52, "spring-0"), (53, "spring-0")]}
    assert [len(trials) for trials in select_trials(labels).values()] == [9, 9]
