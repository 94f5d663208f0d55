"""Dates of campaign files: text in UTC outside, modified Julian dates inside."""

from datetime import UTC, datetime, timedelta

EXAMPLE = '"2019-01-01T12:00:00"'
_ORIGIN = datetime(1858, 11, 17, tzinfo=UTC)
_DAY_S = 86_400.0


def modified_julian_date(text: str) -> float:
    """Days since 1858-11-17 00:00 UTC of a date in ISO 8601; UTC if it has no offset.

    A day has 86 400 s, so leap seconds, :60, are not supported.  ValueError for text that is not a date, OverflowError
    if the offset leads out of the years 1 to 9999.
    """
    moment = datetime.fromisoformat(text)
    moment = moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)
    since = moment - _ORIGIN
    return since.days + (since.seconds + 1e-6 * since.microseconds) / _DAY_S


def date_text(mjd: float) -> str:
    """The date in UTC, to a microsecond, of a modified Julian date.  OverflowError outside the years 1 to 9999.

    ValueError for NaN.
    """
    return (_ORIGIN + timedelta(days=mjd)).replace(tzinfo=None).isoformat()
