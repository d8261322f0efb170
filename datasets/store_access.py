"""How an object store is asked: patience, and where access keys come from, so that who has none is told soon."""

from __future__ import annotations

import os
from urllib.parse import parse_qs, urlsplit

RETRY = "retry_limit_seconds"
RETRY_S = 30  # of gs://, where pyarrow tries for 15 minutes, also to get access keys that are nowhere
METADATA_S = 1.0  # within which a machine of Amazon's tells that it has access keys
NO_METADATA, METADATA = "AWS_EC2_METADATA_DISABLED", "AWS_EC2_METADATA_SERVICE_ENDPOINT"
ELSEWHERE = ("AWS_ACCESS_KEY_ID", "AWS_EC2_METADATA_SERVICE_ENDPOINT_MODE", NO_METADATA)  # if set, nothing is to ask


def patient_for_a_while(scheme: str, query: str) -> str:
    """Options of a URL with a limit on how long a request is tried again."""
    if scheme != "gs" or RETRY in parse_qs(query):
        return query
    return "&".join(filter(None, [query, f"{RETRY}={RETRY_S}"]))


def ask_no_silent_metadata() -> None:
    """Where no server tells a machine's access keys, pyarrow is told not to wait for it: it would, at each request.

    Without any keys it then asks the store without, which refuses unless everybody may read.
    """
    if any(os.environ.get(name) for name in ELSEWHERE):
        return
    address = urlsplit(os.environ.get(METADATA) or "http://169.254.169.254")
    if not _answers(address.hostname or "", address.port):
        os.environ[NO_METADATA] = "true"


def _answers(host: str, port: int | None) -> bool:
    from http.client import HTTPConnection, HTTPException

    try:
        asked = HTTPConnection(host, port, timeout=METADATA_S)
        asked.request("GET", "/")
        asked.getresponse().close()
        asked.close()
    except (OSError, HTTPException):
        return False
    return True
