"""The web application: all routes over one plant."""

from fastapi import FastAPI
from starlette.middleware.cors import CORSMiddleware
from starlette.responses import RedirectResponse

from api import catalogue, command_routes, health, lines, stops, streams
from api.bodies import groups, info, moves, text_commands
from api.common import problems
from api.common.security import SameSite
from api.common.version import VERSION
from api.front import documents
from api.robots import routes as robots
from gateway.plant import Plant

DESCRIPTION = """\
RORZE RC-420 motion controllers behind RC-400 link masters, and Fics robots that speak C-HOST.

Bodies are addressed by two hex digits where only one line has them (`3F`), and always with their line
(`arm.3F`); robots by their names, and their axes by unit. Errors are problem details (RFC 9457); `moved`
says whether the motor did anything. Statuses that clients repeat by themselves are sent only where nothing
was sent to a controller. A software stop does not replace a hardware stop.
"""


def create_app(plant: Plant) -> FastAPI:
    """Make the application. The plant is started and closed by whoever serves it."""
    app = FastAPI(
        title="motion-gateway",
        version=VERSION,
        description=DESCRIPTION,
        # Its own would be made anew at every request.
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        separate_input_output_schemas=False,
        redirect_slashes=False,
        # What matters is counted and recorded at the lines.
        telemetry={"tracing": False, "metrics": False, "logs": False},
    )
    app.state.plant = plant
    app.state.metrics = health.metrics_of(plant)
    problems.install(app)
    modules = (info, moves, stops, groups, lines, streams, catalogue, text_commands, health)
    routers = [info.reads, *(module.router for module in modules)]
    for name, family in plant.families.items():
        routers += robots.routers() if name == "fics" else []
        routers += command_routes.routers(type(family))
    # Side by side instead of included, which would search them twice for every request; and before the docs.
    app.router.routes[:0] = [route for router in routers for route in router.routes]
    documents.install(app)
    app.add_api_route("/", _to_docs, include_in_schema=False)
    server = plant.config.server
    if server.allowed_origins:
        app.add_middleware(
            CORSMiddleware, allow_origins=server.allowed_origins, allow_methods=["*"], allow_headers=["*"]
        )
    app.add_middleware(SameSite, allowed_hosts=server.allowed_hosts, allowed_origins=server.allowed_origins)
    return app


def make_documents(app: FastAPI) -> None:
    """Make all that never changes, before anybody can ask for it: it takes a second or two."""
    documents.make_ready([*app.state.documents, *catalogue.TABLES.values()])


async def _to_docs() -> RedirectResponse:
    """Show whoever comes with nothing but the address what there is."""
    return RedirectResponse("/docs")
