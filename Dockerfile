# SPDX-License-Identifier: BSD-3-Clause
# The command gpureg and the Python package, CPU backend:
#   docker build -t gpureg .
#   docker run --rm -v "$PWD:/data" gpureg register /data/a.ply /data/b.ply
# With CUDA: docker build --build-arg BASE=nvidia/cuda:12.6.3-devel-ubuntu24.04 --build-arg RUNTIME=nvidia/cuda:12.6.3-base-ubuntu24.04 \
#   --build-arg CUDA=ON -t gpureg . && docker run --gpus all ...
ARG BASE=debian:12
ARG RUNTIME=debian:12-slim

FROM ${BASE} AS build
ARG CUDA=OFF
RUN apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
      build-essential cmake ninja-build git libeigen3-dev libcli11-dev nlohmann-json3-dev libpng-dev libembree-dev libassimp-dev \
      python3 python3-dev python3-venv python3-pip && rm -rf /var/lib/apt/lists/*
WORKDIR /src
COPY . .
RUN python3 -m venv /opt/gpureg && \
    CMAKE_ARGS="-DGPUREG_CUDA=${CUDA}" /opt/gpureg/bin/pip install --no-cache-dir '.[batch]'

FROM ${RUNTIME}
RUN apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
      python3 libpng16-16 libembree-dev libassimp5 && rm -rf /var/lib/apt/lists/*
COPY --from=build /opt/gpureg /opt/gpureg
ENV PATH=/opt/gpureg/bin:$PATH
WORKDIR /data
ENTRYPOINT ["gpureg"]
