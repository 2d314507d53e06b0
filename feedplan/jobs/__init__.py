"""Jobs: plans that are made in other processes of this computer or on a cluster.

    batch, service ──► executor: processes | cluster ──► work ──► planning, files
                                (process)  (cluster_task)

An `order` says what to plan, an `outcome` the result, both as plain values that can be sent; `work` plans one
job. `executor` is the interface of what runs jobs: `processes` of this computer, or the workers of a Dask
`cluster`. `identity` tells whether two installations of feedplan are equal, `address` which clusters are
allowed. All executors give equal files bit for bit, except the computing times in them.
"""
