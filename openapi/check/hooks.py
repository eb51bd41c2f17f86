"""What schemathesis has to be told to send scans as CBOR."""

import cbor2
import schemathesis


@schemathesis.serializer("application/cbor")
def cbor(_context: schemathesis.SerializationContext, value: object) -> bytes:
    return cbor2.dumps(value)
