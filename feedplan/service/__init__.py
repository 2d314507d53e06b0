"""The planner as a service over HTTP: jobs are accepted, planned in processes or on a cluster, and kept.

    guard ──► app ──► store ◄── runner ──► feedplan.jobs (processes | cluster) ──► planning, files

`limits` and `refusals` are what all share, `requests` what a client sends, `uploads` receives it, `answers`
is what it gets, `problems` what it gets otherwise. `store` has the folders of jobs, `database` their records,
`runner` has them planned, `views` and `exports` tell of them, `events` how far they are. `app` has the
addresses, `guard` stands before all of it, `openapi` and `page` are the documentation, `command` has the
options, `server` starts everything. The packages it needs come with `pip install feedplan[serve]`.
"""
