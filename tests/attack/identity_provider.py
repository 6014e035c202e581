"""An identity provider: a key of openssl's, and the tokens that it signs."""
import base64
import json
import os
import subprocess
import time


def base64url(raw):
    return base64.urlsafe_b64encode(raw).rstrip(b"=").decode()


class IdentityProvider:
    def __init__(self, folder, openssl, name):
        self.openssl = openssl
        self.key = os.path.join(folder, name + ".key")
        subprocess.run([openssl, "genpkey", "-quiet", "-algorithm", "RSA", "-pkeyopt",
                        "rsa_keygen_bits:2048", "-out", self.key], check=True)
        self.public = subprocess.run([openssl, "pkey", "-in", self.key, "-pubout"], check=True,
                                     capture_output=True).stdout

    def key_set(self):
        modulus = subprocess.run([self.openssl, "rsa", "-in", self.key, "-modulus", "-noout"],
                                 check=True, capture_output=True, text=True).stdout
        number = bytes.fromhex(modulus.strip().split("=")[1])
        return json.dumps({"keys": [{"kty": "RSA", "kid": "k", "use": "sig", "alg": "RS256",
                                     "n": base64url(number), "e": "AQAB"}]})

    def claims(self, **other):
        return {"iss": "https://login.example", "aud": "vantage", "sub": "anna",
                "tenant": "museum", "roles": ["administer"], "exp": int(time.time()) + 3600,
                **other}

    def text(self, header, claims):
        return ".".join(base64url(json.dumps(part).encode()) for part in (header, claims))

    def token(self, header=None, **other):
        text = self.text({"alg": "RS256", "kid": "k", **(header or {})}, self.claims(**other))
        signature = subprocess.run([self.openssl, "dgst", "-sha256", "-sign", self.key],
                                   input=text.encode(), check=True, capture_output=True).stdout
        return text + "." + base64url(signature)
