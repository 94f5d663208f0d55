"""Definitions of the terms of a report, with what its numbers mean and do not mean."""

from reports.document.blocks import Terms

GLOSSARY = Terms(
    (
        (
            "case",
            "One flight with its own drawn inputs. It is addressed by its number: the same seed and number give "
            "the same flight, alone or among a million.",
        ),
        (
            "nominal",
            "The flight with all inputs at their nominal values. It has the number −1 and is not part of any "
            "statistic.",
        ),
        (
            "dispersion",
            "An input that differs from case to case, with its distribution and the source of this distribution.",
        ),
        (
            "metric",
            "A number that describes the result of a flight. A failed case has none: it is counted, never dropped.",
        ),
        (
            "n of n tried",
            "The number of cases on which a result is based, and the number flown. The others failed, or have a "
            "metric that is not a number.",
        ),
        (
            "requirement",
            "A limit on a metric, the probability with which a case must lie inside it, and the confidence with which "
            "the flown cases must demonstrate that probability.",
        ),
        (
            "pass",
            "The lower confidence bound on the probability, at the required confidence, is at least the required "
            "probability. The bound is that of Clopper and Pearson if the number of cases was fixed in advance; with "
            "interim analyses it is a bound that holds at every number of cases at once.",
        ),
        (
            "fail",
            "The upper confidence bound, at the same confidence, is below the required probability.",
        ),
        (
            "not demonstrable",
            "Neither pass nor fail: more cases are needed, or the design gives no probabilities.",
        ),
        (
            "demonstrated bound",
            "Tolerance limit: the required fraction of cases lies inside it with the required confidence. An order "
            "statistic (Wilks), distribution-free. Two limits are both moved inward by the same distance: the margin "
            "to the nearer limit that the required fraction of cases has. Cases without a number take the worst "
            "ranks.",
        ),
        (
            "consumer’s risk",
            "The probability that the cases pass a system that just misses the required probability. The producer’s "
            "risk is the probability that they do not pass a system that fails only half as often as allowed. More "
            "cases lower it.",
        ),
        (
            "percentile",
            "The value below which the stated percentage of cases lies. No normal distribution is assumed.",
        ),
        (
            "confidence bounds",
            "For a percentile, two order statistics, each on its side of the true percentile with the confidence of "
            "the report. A dash: the cases are too few for that bound. Probability and confidence are those of "
            "[report] in the campaign file, 99.73 % and 90 % by default; a requirement may have its own.",
        ),
        (
            "exactness of the bounds",
            "Bounds on probabilities and percentiles are exact for independent draws (mc); intervals of means and of "
            "the effects of inputs are approximate. The number of cases was fixed in advance unless the report says "
            "otherwise. Latin hypercube and Sobol designs scatter less, so the same bounds are then conservative. "
            "Bounds do not cover errors of the model.",
        ),
        (
            "ellipse",
            "The covariance ellipse of the cases, scaled so that it would contain the stated fraction of a normal "
            "distribution. The fraction that it contains is counted. It is omitted where it would exceed the physical "
            "range of a metric.",
        ),
        (
            "distribution-free region",
            "Contains at least the stated fraction of all possible cases, with the stated confidence, for any "
            "distribution: its shape is computed from half of the cases, its size from the other half.",
        ),
        (
            "limit in a time history",
            "Drawn if the metric of the requirement is the largest or smallest value of the quantity in the saved "
            "histories. A dashed limit applies at the end of the flight, or has to be met only once.",
        ),
        (
            "comparison of options",
            "Cases that differ only in one option form pairs; differences within pairs are free of the scatter of the "
            "other inputs.",
        ),
        (
            "first-order effect",
            "First-order Sobol’ index: the fraction of a metric’s variance that is due to the contributor alone, which "
            "is removed when it is known. SRC, PRCC and Spearman measure trends only, and give their direction.",
        ),
        (
            "total effect",
            "Total Sobol’ index: the fraction of a metric’s variance that is due to the contributor and its "
            "interactions with others, which remains when everything else is known.",
        ),
        (
            "variance reduction at nominal",
            "Fraction by which a metric’s variance falls if the contributor has its nominal value in all cases; noise "
            "made in flight stays as drawn. Its average over all values that the contributor may be held at is the "
            "first-order effect; where inputs interact, the nominal value may be far from an average one.",
        ),
        (
            "random draws",
            "Noise made in flight, and inputs that only select a draw, such as the number of a day’s weather.",
        ),
        (
            "contributor to failures",
            "An input, or a pair of inputs, whose values differ between failed and passed cases by more than chance "
            "among all that were tested. A difference, not a proof of a cause.",
        ),
        (
            "margin",
            "Distance inside the nearest limit, negative outside. In percent: of the size of a single limit, or of "
            "half the distance between two, so that 100 % is midway between them.",
        ),
        (
            "worst cases",
            "Those with the smallest margin to the nearest limit; for a metric without a requirement, those with the "
            "largest values. The tables show the inputs that contribute most.",
        ),
        (
            "map",
            "The surface is exact where a full grid was flown; else it is smoothed from scattered cases by local "
            "quadratic regression, with a number of nearest cases chosen by cross-validation. Its error is one "
            "standard deviation, from the scatter of the cases and from the bias where the surface is curved. Blank "
            "where the cases do not support a surface.",
        ),
        (
            "1σ budget",
            "1σ contribution: √(first-order effect) × σ of the metric, where the effect is more than noise, and no "
            "more than the total effect may be. The root sum square of all contributions is below σ by what "
            "interactions and unexplained draws add; where they add nothing, the errors of the effects may put it "
            "slightly above σ.",
        ),
        (
            "circular error probable (CEP)",
            "The radius of the circle that contains 50 % of the impact points: about the target if there is one, else "
            "about the mean impact point.",
        ),
    )
)
