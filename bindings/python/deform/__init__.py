"""Soft bodies that touch each other with true friction: the Python side of libdeform.

    import deform
    with deform.World() as world:
        world.add_obstacle("plane")
        ball = world.add_body(deform.TetMesh.ball(0.1, cells=500), position=(0, 0, 0.15))
        world.run(0.5, dt=1e-3)
        print(ball.measure.com, world.contacts["fn"].sum())

SI units throughout; arrays are NumPy's, float64.
"""
from ._context import Context, Parameter, PluginType, default_context
from ._library import (ArgumentError, BusyError, Discarded, Diverged, Error, FileError, FormatError,
                       HandleError, OutOfMemory, StateError, UnsupportedError, quick as _quick)
from .body import Body, Obstacle, Rigid
from .mesh import TetMesh, TriMesh
from .picture import Picture
from .scene import Run, Scene, run
from .world import Material, Trouble, World

__version__: str = _quick.dfm_version(None, None, None).decode()

__all__ = ["ArgumentError", "Body", "BusyError", "Context", "Discarded", "Diverged", "Error",
           "FileError", "FormatError", "HandleError", "Material", "Obstacle", "OutOfMemory", "Parameter",
           "Picture", "PluginType", "Rigid", "Run", "Scene", "StateError", "TetMesh", "TriMesh",
           "Trouble", "UnsupportedError", "World", "default_context", "run"]
