# A bare Debian with a compiler, and the packages that programs of others are built with: first the
# planner alone, then the client, a server to call, and the planner for Python.
ARG BASE
FROM ${BASE} AS core
RUN apt-get -q update && DEBIAN_FRONTEND=noninteractive \
    apt-get -q install -y --no-install-recommends g++ cmake ninja-build
COPY libvantage-core-dev_*.deb /packages/
RUN DEBIAN_FRONTEND=noninteractive \
    apt-get -q install -y --no-install-recommends /packages/*.deb

FROM core
COPY libvantage-client-dev_*.deb vantage-server_*.deb python3-vantage-core_*.deb /packages/
RUN DEBIAN_FRONTEND=noninteractive \
    apt-get -q install -y --no-install-recommends /packages/*.deb
