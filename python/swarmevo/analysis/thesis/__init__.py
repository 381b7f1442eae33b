"""The figures of the thesis, drawn from champions that evolved here.

    python -m swarmevo.analysis.thesis leader_selection -o figures

draws those of one experiment, from ``results/`` (after ``results/fetch``) and ``configs/`` of the project.
"""
