"""What C_0 may be: functions of the arm's motion that are made as small as they can be, one file each.

A goal is a subclass of :class:`~actuator.terms.goals.interface.Goal`, and its section of the case file is registered in
:data:`stages.goals.GOALS`.
"""
