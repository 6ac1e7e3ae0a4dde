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
                       HandleError, OutOfMemory, StateError, UnsupportedError, include_dir, quick as _quick,
                       template_dir)
from .body import Body, Obstacle, Rigid, rotation
from .cut import CutInfo
from ._command import command, cost, explain
from ._serve import Server, serve
from .rig import friction, plot_friction
from .law import Law, PythonLaw
from .mesh import TetMesh, TriMesh
from .picture import Picture
from .query import ContactChoice, Filter, Hit, Shape
from .rigid_set import JointDef, Material, RigidDef
from .scene import Run, Scene, run
from .study.fit import Fit, fit
from .study.sweep import Sweep, sweep
from .tool import Tool
from .world import Trouble, World

__version__: str = _quick.dfm_version(None, None, None).decode()

__all__ = ["ArgumentError", "Body", "BusyError", "ContactChoice", "Context", "CutInfo",
           "Discarded", "Diverged", "Error", "FileError", "Filter", "Fit", "FormatError",
           "HandleError", "Hit", "JointDef", "Law", "Material", "Obstacle", "OutOfMemory",
           "Parameter", "Picture", "PluginType", "PythonLaw", "Rigid", "RigidDef", "Run", "Scene",
           "Server", "Shape", "StateError", "Sweep", "TetMesh", "Tool", "TriMesh", "Trouble",
           "UnsupportedError", "World", "command", "cost", "default_context", "explain", "fit",
           "friction", "include_dir", "plot_friction", "rotation", "run", "serve", "sweep",
           "template_dir"]
