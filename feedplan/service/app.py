"""The addresses (routes) of the service."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path as FilePath
from typing import Annotated, Any, get_origin

from fastapi import APIRouter, Depends, FastAPI, Header, Query
from fastapi.responses import (
    FileResponse,
    HTMLResponse,
    JSONResponse,
    Response,
    StreamingResponse,
)
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request

from feedplan import __version__, outputs, planners
from feedplan.jobs.executor import Executor
from feedplan.machine.controller import MODELS
from feedplan.machine.machine import Machine, bundled_machines
from feedplan.plan_folder import DRAWING_FILE, SUMMARY_FILE
from feedplan.report.page import FILE as REPORT_FILE
from feedplan.service import answers, events, exports, front, openapi, page, problems, uploads, views
from feedplan.service.limits import Limits
from feedplan.service.refusals import INPUT, UNKNOWN, Refusal
from feedplan.service.requests import MachineRequest, machine_of, order_of, require_once
from feedplan.service.runner import Runner
from feedplan.service.store import ENDED, Store

# The greatest number of requests whose programs are received at the same time; each needs memory.
RECEIVED_AT_ONCE = 4
MOST_COMPARED = 20
# A report may only run its own scripts, and may not send requests to the service.
_REPORT_POLICY = (
    "sandbox allow-scripts allow-downloads; default-src 'none'; style-src 'unsafe-inline'; "
    "script-src 'unsafe-inline'; img-src data: blob:"
)
_PAGE_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"

Key = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        max_length=200,
        description="Requests with the same key give the same job",
    ),
]
Time = Annotated[float | None, Query(allow_inf_nan=False)]


def _known_query(request: Request) -> None:
    """Raises Refusal for a query parameter that is unknown, or repeated without being a list."""
    known = {own.alias: own.field_info.annotation for own in request.scope["route"].dependant.query_params}
    for name in request.query_params:
        if name not in known:
            raise Refusal(INPUT, f"query.{name[:60]}: there is no such parameter: give {', '.join(known)}")
        if get_origin(known[name]) is not list and len(request.query_params.getlist(name)) > 1:
            raise Refusal(INPUT, f"query.{name}: it comes more than once: give it once")


async def _once_in_body(request: Request) -> None:
    """Raises Refusal for a name that comes twice in an object of the request."""
    require_once(await request.body())


QUERY = Depends(_known_query)


class Service:
    """The objects that all addresses share."""

    def __init__(self, folder: FilePath, limits: Limits, executor: Executor) -> None:
        self.limits = limits
        self.bell = events.Bell()
        self.store = Store(folder, limits, self.bell.ring)
        self.runner = Runner(self.store, limits, executor)
        self.receiving = asyncio.Semaphore(RECEIVED_AT_ONCE)

    @asynccontextmanager
    async def lifespan(self, _: FastAPI) -> AsyncIterator[None]:
        """Runs jobs while the application runs."""
        self.bell.attach(asyncio.get_running_loop())
        self.runner.start()
        try:
            yield
        finally:
            self.bell.attach(None)
            await run_in_threadpool(self.runner.stop)
            self.store.close()


def create(folder: FilePath, limits: Limits, executor: Executor) -> FastAPI:
    """The application on a store, without its guard; jobs run on `executor`. Raises InputError if the store
    cannot be used."""
    service = Service(folder, limits, executor)
    app = FastAPI(
        title="feedplan",
        version=__version__,
        description=openapi.DESCRIPTION,
        docs_url=None,
        redoc_url=None,
        openapi_url="/v1/openapi.json",
        lifespan=service.lifespan,
    )
    problems.add_handlers(app)
    _add_jobs(app, service)
    _add_results(app, service)
    _add_knowledge(app, service)
    front.add(app)
    openapi.complete(app)
    return app


def _file(file: FilePath, **more: Any) -> FileResponse:
    """A file as an answer; raises FileNotFoundError if it is gone."""
    return FileResponse(file, stat_result=file.stat(), **more)


def _add_jobs(app: FastAPI, service: Service) -> None:
    store, runner, limits = service.store, service.runner, service.limits
    router = APIRouter(tags=["jobs"])

    @router.post(
        "/v1/jobs",
        status_code=202,
        response_model=answers.Job,
        summary="Submit a program to be planned",
        responses={
            200: {"model": answers.Job, "description": "The job of an earlier, equal request"},
            **openapi.problems(400, 415, 422, 429, 507),
        },
        openapi_extra=openapi.SUBMISSION,
    )
    async def submit(request: Request, key: Key = None) -> Response:
        """Accepts a program, a machine and options, as JSON or as a form; the job waits for its turn. If an
        equal request waits, runs or is done, the answer is that job (200), so that nothing is planned
        twice."""

        def accepted() -> tuple[dict[str, Any], bool]:
            record, is_new = store.accept(upload, order_of(asked, limits), key)
            return views.job(record), is_new

        async with service.receiving:
            upload, asked = await uploads.received(request, store.new, limits)
            try:
                job, is_new = await run_in_threadpool(accepted)
            finally:
                upload.file.unlink(missing_ok=True)
        if is_new:
            await run_in_threadpool(runner.wake)
        headers = {"Location": job["links"]["self"]}
        return JSONResponse(job, 202 if is_new else 200, headers)

    @router.get(
        "/v1/jobs",
        response_model=answers.Jobs,
        summary="List jobs, the newest first",
        dependencies=[QUERY],
        responses=openapi.problems(422),
    )
    def listed(
        state: answers.State | None = None,
        before: Annotated[int | None, Query(ge=0, lt=1 << 62)] = None,
        count: Annotated[int, Query(ge=1, le=200)] = 50,
    ) -> dict[str, Any]:
        records = store.jobs(state, before, count)
        more = records[-1]["number"] if len(records) == count else None
        return {"jobs": [views.job(record) for record in records], "before": more}

    @router.get(
        "/v1/jobs/{job}",
        response_model=answers.Job,
        summary="Progress and result of a job",
        responses=openapi.problems(404),
    )
    def one(job: str) -> dict[str, Any]:
        return views.job(store.job(job))

    @router.delete(
        "/v1/jobs/{job}",
        status_code=204,
        summary="Forget a job and its files; it is stopped if it runs",
        responses=openapi.problems(404),
    )
    def delete(job: str) -> Response:
        runner.delete(job)
        return Response(status_code=204)

    @router.post(
        "/v1/jobs/{job}/cancel",
        status_code=202,
        response_model=answers.Job,
        summary="Stop a job that waits or runs",
        responses=openapi.problems(404),
    )
    def cancel(job: str) -> dict[str, Any]:
        """A running job stops within about a tenth of a second; a job that has ended does not change."""
        runner.cancel(job)
        return views.job(store.job(job))

    @router.get(
        "/v1/jobs/{job}/events",
        summary="Progress as server-sent events",
        response_class=StreamingResponse,
        responses={
            200: openapi.content(events.MEDIA_TYPE, openapi.EVENTS, "Events until the job has ended"),
            204: {"description": "The job has ended and all of its events are known"},
            **openapi.problems(404),
        },
    )
    def progress(
        job: str, last: Annotated[str | None, Header(alias="Last-Event-ID", max_length=40)] = None
    ) -> Response:
        """The stream continues after the event whose number the client sends as `Last-Event-ID`."""
        after = int(last) if last and last.isascii() and last.isdigit() and len(last) < 18 else 0
        record = store.job(job)
        if record["state"] in ENDED and after and not store.events(job, after):
            return Response(status_code=204)
        return StreamingResponse(events.stream(store, service.bell, job, after), media_type=events.MEDIA_TYPE)

    app.include_router(router)


def _add_results(app: FastAPI, service: Service) -> None:
    store = service.store
    router = APIRouter(tags=["results"])
    missing = openapi.problems(404, 409)

    @router.get(
        "/v1/jobs/{job}/result",
        summary="All of plan.json",
        response_class=FileResponse,
        responses={200: openapi.content("application/json", {"type": "object"}, "plan.json"), **missing},
    )
    def result(job: str) -> Response:
        return _file(views.done(store, job) / SUMMARY_FILE, media_type="application/json")

    @router.get("/v1/jobs/{job}/audit", summary="The audit of the plan", responses=missing)
    def audit(job: str) -> dict[str, Any]:
        verdict: dict[str, Any] = views.summary(views.done(store, job))["audit"]
        return verdict

    @router.get(
        "/v1/jobs/{job}/setpoints",
        summary="Setpoints, by time and axis",
        dependencies=[QUERY],
        response_class=FileResponse,
        responses={
            200: openapi.contents({exports.media_type(name) for name in exports.formats()}),
            **openapi.problems(404, 409, 422, 501),
        },
    )
    def setpoints(
        job: str,
        start: Annotated[Time, Query(alias="from", description="First time [s]")] = None,
        end: Annotated[Time, Query(alias="to", description="Last time [s]")] = None,
        axes: Annotated[str, Query(max_length=400, description="Names with commas; all unless given")] = "",
        format: outputs.FormatName = "npz",
    ) -> Response:
        names = [name.strip() for name in axes.split(",")] if axes.strip() else []
        file, is_new = exports.setpoints_file(views.done(store, job), store.new, format, names, start, end)
        after = BackgroundTask(shutil.rmtree, file.parent, ignore_errors=True) if is_new else None
        return _file(file, media_type=exports.media_type(format), filename=file.name, background=after)

    @router.get(
        "/v1/jobs/{job}/program",
        summary="The program as it was sent",
        response_class=FileResponse,
        responses={
            200: openapi.content("application/octet-stream", openapi.BINARY, "The program"),
            **openapi.problems(404),
        },
    )
    def program(job: str) -> Response:
        record = store.job(job)
        return _file(
            store.folder(record) / "program", media_type="application/octet-stream", filename=record["name"]
        )

    @router.get(
        "/v1/jobs/{job}/report",
        summary="The report, one page that needs no network",
        response_class=HTMLResponse,
        responses=missing,
    )
    def report(job: str) -> Response:
        headers = {"Content-Security-Policy": _REPORT_POLICY}
        return _file(views.done(store, job) / REPORT_FILE, media_type="text/html", headers=headers)

    @router.get(
        "/v1/jobs/{job}/drawing",
        summary="The data that the page draws: tool path, speed and axes, as arrays",
        response_class=FileResponse,
        responses={
            200: openapi.content(
                "application/octet-stream", openapi.BINARY, "A table in JSON, and its arrays after it"
            ),
            **missing,
        },
    )
    def drawing(job: str) -> Response:
        """The answer consists of 4 bytes with the length of the JSON (little-endian), the JSON, and the
        arrays.

        The JSON has `{"array": "f4", "at": 0, "count": 3}` instead of each array: little-endian numbers (f4,
        i4 or u1) from byte `at` after the JSON."""
        return _file(views.done(store, job) / DRAWING_FILE, media_type="application/octet-stream")

    @router.get(
        "/v1/compare",
        response_model=answers.Comparison,
        summary="Compare jobs in one table",
        dependencies=[QUERY],
        responses=openapi.problems(404, 422),
    )
    def compare(
        job: Annotated[list[str], Query(min_length=1, max_length=MOST_COMPARED)],
    ) -> dict[str, Any]:
        """One row for each job, in the order of the request: `?job=ID&job=ID`."""
        return {"rows": [views.compared(store, name) for name in job]}

    app.include_router(router)


def _add_knowledge(app: FastAPI, service: Service) -> None:
    router = APIRouter(tags=["knowledge"])

    @router.get("/v1/machines", response_model=answers.Machines, summary="The bundled machines")
    def machines() -> dict[str, Any]:
        return {"machines": [views.machine(Machine.load(name)) for name in bundled_machines()]}

    @router.post(
        "/v1/machines",
        response_model=answers.MachineInfo,
        summary="Read a machine file, and change limits in it",
        dependencies=[Depends(_once_in_body)],
        responses=openapi.problems(400, 422),
        openapi_extra=openapi.MACHINE,
    )
    def understood(asked: MachineRequest) -> dict[str, Any]:
        """The service keeps nothing; plan with `file` of the answer."""
        return views.machine(machine_of(asked))

    @router.get(
        "/v1/machines/{name}",
        response_model=answers.MachineInfo,
        summary="One bundled machine",
        responses=openapi.problems(404),
    )
    def machine(name: str) -> dict[str, Any]:
        if name not in bundled_machines():
            raise Refusal(UNKNOWN, f"there is no such machine: use one of {', '.join(bundled_machines())}")
        return views.machine(Machine.load(name))

    @router.get(
        "/v1/controllers",
        response_model=answers.Controllers,
        summary="The controllers of today that are modelled",
    )
    def controllers() -> dict[str, Any]:
        return {"controllers": [views.controller(name, model) for name, model in MODELS.items()]}

    @router.get("/v1/methods", response_model=answers.Methods, summary="The planning methods")
    def methods() -> dict[str, Any]:
        known = planners.methods()
        return {"methods": [{"name": name, "options": planners.options_of(name)} for name in known]}

    @router.get("/v1/health", response_model=answers.Health, summary="Whether the service works")
    def health() -> dict[str, Any]:
        counts = service.store.counts()
        return {
            "status": "ok",
            "version": __version__,
            **{state: counts.get(state, 0) for state in ("queued", "running")},
            "limits": service.limits.to_json(),
        }

    app.include_router(router)

    @app.get("/docs", include_in_schema=False)
    def docs() -> Response:
        return HTMLResponse(
            page.documentation(app.openapi()), headers={"Content-Security-Policy": _PAGE_POLICY}
        )
