"""The planner as a service over HTTP: jobs are accepted, planned in processes or on a cluster, and kept.

    guard ──► app ──► store ◄── runner ──► feedplan.jobs (processes | cluster) ──► planning, files

- Requests: `guard` checks each one, `app` has the addresses, `uploads` receives programs, `requests` checks
  their content, `problems` answers errors.
- Jobs: `store` has their folders, `database` their records, `runner` runs them on an executor.
- Answers: `answers` has their types, `views` and `exports` make them, `events` streams progress, `front` has
  the page, `openapi` and `page` the documentation.
- Shared: `limits` and `refusals`. `server` starts the service.

`pip install feedplan[serve]` installs the packages.
"""
