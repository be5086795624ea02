"""Many recordings: a plan, its tasks with one state each, workers that claim them, and a table of the results.

Imports `pipeline`, `api` and what stands below them. Callers use `plan.read_plan`, `checks.problems`,
`manifest.Manifest`, `worker.work` and `results.summarize`; local processes, a job array and a cluster all run
`worker.work`. A long recording is divided (`stretches`), tracked in copies of its session (`stretch_work`) and joined
(`join`).
"""

__all__ = ["checks", "manifest", "plan", "results", "task_files", "worker"]
