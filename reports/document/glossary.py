"""Definitions of the terms of a report, with what its numbers mean and do not mean."""

from reports.document.blocks import Terms

GLOSSARY = Terms(
    (
        (
            "case",
            "One flight with its own drawn inputs. It is addressed by its number: the same seed and number give "
            "the same flight, alone or among a million.",
        ),
        ("nominal", "The flight with every input at its nominal value; it has the number −1 and is in no statistic."),
        ("dispersion", "An input that differs from case to case, with its distribution and the source of that."),
        ("metric", "A number that a flight ends with. A failed case has none: it is counted, never dropped."),
        (
            "n of n tried",
            "How many cases a number rests on, of how many were flown. The difference failed, or has a "
            "metric that is not a number.",
        ),
        (
            "requirement",
            "A limit on a metric, the probability with which a case must lie inside it, and the confidence with which "
            "the flown cases must demonstrate that probability.",
        ),
        (
            "pass",
            "The lower confidence bound on the probability, at the confidence required, reaches the one required. The "
            "bound is Clopper and Pearson’s where the number of cases was fixed in advance; with interim analyses it "
            "is one that holds at every number of cases at once.",
        ),
        ("fail", "Even the upper bound, at the same confidence, stays below the probability required."),
        (
            "not demonstrable",
            "The cases decide neither way: more of them are needed, or the design gives no probabilities.",
        ),
        (
            "demonstrated bound",
            "Tolerance limit: the required fraction of cases lies inside it with the required confidence. An order "
            "statistic (Wilks), distribution-free. Of two limits, both are moved inward by the distance to the nearest "
            "that the required fraction keeps. Cases without a number take the worst ranks.",
        ),
        (
            "consumer’s risk",
            "The probability that the cases pass a system that just misses the probability required. The producer’s "
            "risk is the reverse: that they do not pass one that fails only half as often as it may. More cases "
            "lower it.",
        ),
        (
            "percentile",
            "The value below which the stated percentage of cases lies. No normal distribution is assumed.",
        ),
        (
            "confidence bounds",
            "Of a percentile two order statistics, each on its side of the true percentile with the confidence of the "
            "report. A dash: the cases are too few for that bound. Probability and confidence are those of [report] in "
            "the campaign file, 99.73 % and 90 % by default; a requirement may have its own.",
        ),
        (
            "exactness of the bounds",
            "Bounds and intervals are exact for independent draws (mc), in a number that was fixed in advance unless "
            "the report says otherwise. Latin hypercube "
            "and Sobol designs scatter less, so the same bounds are then on the safe side. Nothing is said "
            "of the correctness of the model.",
        ),
        (
            "ellipse",
            "The covariance ellipse of the cases, scaled so that it would hold the stated fraction of a normal "
            "distribution. The fraction that it holds is counted. It is left out where it would leave the physical "
            "range of a metric.",
        ),
        (
            "distribution-free region",
            "Holds at least the stated fraction of all possible cases, with the stated confidence, whatever their "
            "distribution: half of the cases draw it, the other half set its size.",
        ),
        (
            "limit in a time history",
            "Drawn where the metric of the requirement is the largest or smallest value of the quantity in the saved "
            "histories. A dashed limit holds at the end of the flight, or must be met once.",
        ),
        (
            "comparison of options",
            "Cases that differ in one option and have all other inputs in common are pairs; differences within pairs "
            "are free of the scatter of the draws.",
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
            "Noise made in flight, and inputs that only name a draw, such as the number of a day’s weather.",
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
            "Those with the smallest margin to the nearest limit; of a metric without a requirement, the largest. The "
            "tables show the inputs that contribute most.",
        ),
        (
            "map",
            "The surface is exact where a full grid was flown; else it is smoothed from scattered cases by a local "
            "quadratic regression on as many of the nearest cases as cross-validation finds best. Its error is one "
            "standard deviation: the scatter of the cases, and the bias where the surface bends. Blank where the cases "
            "do not support a surface.",
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
            "The radius of the circle that holds 50 % of the impact points: about the target where there is one, "
            "else about the mean impact point.",
        ),
    )
)
