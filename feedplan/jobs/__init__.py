"""Jobs: plans that are made in other processes of this computer or on a cluster.

    batch, service ──► executor: processes | cluster ──► work ──► planning, files
                                (process)  (cluster_task)

An `order` describes what to plan, an `outcome` the result; both are plain values that can be sent. `work`
plans one job. `executor` is the interface of the executors, which run jobs in `processes` of this computer,
or on the workers of a Dask `cluster`. `identity` compares two installations of feedplan, `address` decides
which clusters are allowed. All executors give equal files bit for bit, except for the computing times in
them.
"""
