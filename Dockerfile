FROM python:3.11.14-slim-bookworm

ENV PYTHONUNBUFFERED=1 PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1

# Group dialout owns the serial ports.
RUN useradd --system --no-create-home --groups dialout gateway \
    && install --directory --owner gateway --mode 0700 /var/lib/motion-gateway
VOLUME /var/lib/motion-gateway

WORKDIR /opt/motion-gateway
COPY requirements.txt .
RUN pip install --require-hashes -r requirements.txt
COPY . .
RUN pip install --no-deps --no-build-isolation .

USER gateway
# The gateway listens on the loopback interface only: run it with --network host --device /dev/ttyUSB0
# and with its configuration mounted read-only. Where that names another port or host, the health check and
# `motion-gateway send` have to be told: --env MOTION_GATEWAY_URL=http://127.0.0.1:PORT
ENV MOTION_GATEWAY_URL=http://127.0.0.1:8420
HEALTHCHECK --interval=10s --timeout=3s --start-period=10s \
    CMD ["python", "-c", "import os, urllib.request as url; url.urlopen(os.environ['MOTION_GATEWAY_URL'] + '/livez', timeout=2)"]
CMD ["motion-gateway", "serve", "--config", "/etc/motion-gateway/gateway.toml", \
     "--data", "/var/lib/motion-gateway"]
