"""Agreement against published examples and other programs' formulas."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from brachium_viewer.agreement import agreement

SHROUT_FLEISS = np.array(
    [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], dtype=np.float64
)
"""The ratings of Shrout and Fleiss 1979, table 2: six subjects, four judges."""


def icc_by_sums(a: np.ndarray, b: np.ndarray) -> float:
    """ICC(2,1) by a two-way analysis of variance written out as sums of squares."""
    x = np.column_stack([a, b])
    n, k = x.shape
    total = ((x - x.mean()) ** 2).sum()
    rows = k * ((x.mean(axis=1) - x.mean()) ** 2).sum()
    columns = n * ((x.mean(axis=0) - x.mean()) ** 2).sum()
    msr, msc = rows / (n - 1), columns / (k - 1)
    mse = (total - rows - columns) / ((n - 1) * (k - 1))
    return float((msr - mse) / (msr + (k - 1) * mse + k * (msc - mse) / n))


@pytest.mark.parametrize("pair", [(0, 1), (0, 2), (1, 3), (2, 3)])
def test_icc_is_that_of_the_analysis_of_variance(pair: tuple[int, int]) -> None:
    a, b = SHROUT_FLEISS[:, pair[0]], SHROUT_FLEISS[:, pair[1]]
    found = agreement(a, b)
    assert found is not None
    assert found.icc == pytest.approx(icc_by_sums(a, b), abs=1e-12)


@given(st.integers(0, 10_000))
def test_figures_agree_with_scipy(seed: int) -> None:
    random = np.random.default_rng(seed)
    b = random.normal(size=40) * 20
    a = b + random.normal(size=40) + 0.3
    found = agreement(a, b)
    assert found is not None
    assert found.r == pytest.approx(stats.pearsonr(a, b).statistic, abs=1e-12)
    assert found.wilcoxon_p == pytest.approx(stats.wilcoxon(a, b, method="approx").pvalue)
    low, high = stats.norm.interval(0.95, *((a - b).mean(), (a - b).std(ddof=1)))
    assert found.limits == pytest.approx((low, high), abs=1e-3 * (high - low))
    together = np.cov(a, b, bias=True)
    ccc = 2 * together[0, 1] / (together[0, 0] + together[1, 1] + (a.mean() - b.mean()) ** 2)
    assert found.ccc == pytest.approx(ccc, abs=1e-12)


def test_a_bias_lowers_agreement_and_leaves_correlation() -> None:
    b = np.sin(np.arange(200) / 10.0)
    same, off = agreement(b, b), agreement(b + 1.0, b)
    assert same is not None
    assert off is not None
    assert (same.r, same.icc, same.ccc, same.wilcoxon_p) == pytest.approx((1.0, 1.0, 1.0, 1.0))
    assert off.r == pytest.approx(1.0)
    assert off.icc is not None
    assert off.icc < 0.6
    assert off.ccc is not None
    assert off.ccc < 0.6
    assert off.wilcoxon_p is not None
    assert off.wilcoxon_p < 1e-3
    assert off.limits == pytest.approx((1.0, 1.0))


def test_unknown_pairs_are_left_out_and_too_few_say_nothing() -> None:
    found = agreement([1.0, np.nan, 3.0, 4.0], [1.5, 2.0, np.nan, 4.5])
    assert found is not None
    assert (found.n, found.bias) == (2, -0.5)
    assert (found.r, found.icc, found.ccc, found.wilcoxon_p) == (None, None, None, None)
    assert agreement([np.nan], [1.0]) is None


def test_what_does_not_vary_has_no_correlation() -> None:
    found = agreement([2.0, 2.0, 2.0, 2.0], [2.0, 2.0, 2.0, 2.0])
    assert found is not None
    assert (found.r, found.icc, found.ccc) == (None, None, None)
    assert found.limits == (0.0, 0.0)
