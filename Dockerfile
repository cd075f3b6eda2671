# A tag may be another image tomorrow: docs/install.md says how to give one by its digest.
ARG BASE=python:3.11.14-slim-bookworm
FROM ${BASE}

ENV PYTHONUNBUFFERED=1 PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1

# Group dialout owns the serial ports.
RUN useradd --system --groups dialout --home-dir /var/lib/motion-gateway --create-home motion-gateway

WORKDIR /opt/motion-gateway
COPY requirements.txt .
RUN pip install --require-hashes -r requirements.txt
# The sources; in a release, its wheel.
ARG SOURCE=.
COPY ${SOURCE} ./
RUN pip install --no-deps --no-build-isolation ./${SOURCE}

USER motion-gateway
WORKDIR /var/lib/motion-gateway
VOLUME /var/lib/motion-gateway
# The simulator is in it too: `docker run --network host motion-gateway:0.2.0 motion-gateway serve --demo`.
# Where the configuration names another port or host, the health check and `motion-gateway status` have to be
# told: --env MOTION_GATEWAY_URL=http://127.0.0.1:PORT
ENV MOTION_GATEWAY_URL=http://127.0.0.1:8420
# /livez needs no key, and who serves it is not in doubt here.
HEALTHCHECK --interval=10s --timeout=3s --start-period=10s \
    CMD ["python", "-c", "import os, ssl, urllib.request as url; url.urlopen(os.environ['MOTION_GATEWAY_URL'] + '/livez', timeout=2, context=ssl._create_unverified_context())"]
CMD ["motion-gateway", "serve", "--config", "/etc/motion-gateway/gateway.toml", "--data", "/var/lib/motion-gateway"]
