"""The service on Ray Serve: ``serve run lfd_render.service.ray_app:build processes=1``.

The application is the one that `lfd-render serve` runs, as the ingress of a deployment. Its render
processes stay inside the replica, so that one that dies costs no request.
"""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from ray import serve
from ray.serve import Application, Deployment

from .app import create_app
from .settings import Settings

_MOST_ONGOING = 1000  # more than the queue holds: what is too much is told by it, with Retry-After


def build(given: dict[str, Any]) -> Application:
    """The Serve application with settings of the environment, and those given in their place."""
    settings = Settings.from_environment(**given)

    def ingress() -> FastAPI:
        return create_app(settings)

    deployment: Deployment = serve.deployment(
        name="lfd-render",
        max_ongoing_requests=_MOST_ONGOING,
        graceful_shutdown_timeout_s=settings.drain_s,
        ray_actor_options={"num_cpus": settings.processes},
    )(serve.ingress(ingress)())
    return deployment.bind()
