# A bare Debian with systemd, and the packages installed as an operator would.
ARG BASE
FROM ${BASE}
RUN apt-get -q update && DEBIAN_FRONTEND=noninteractive \
    apt-get -q install -y --no-install-recommends systemd && rm -f /usr/sbin/policy-rc.d
COPY vantage-*.deb /packages/
# With what the server's package recommends.
RUN DEBIAN_FRONTEND=noninteractive \
    apt-get -q install -y --no-install-recommends /packages/*.deb haproxy openssl
