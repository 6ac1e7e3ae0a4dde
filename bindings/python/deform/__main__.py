"""python -m deform demo [OUT_DIR]: the picture of the front page; other words are those of the command."""
import pathlib
import sys

from ._command import main
from ._library import command_path, demo_scene

if sys.argv[1:2] == ["demo"]:
    from .demo import demo
    out = (sys.argv[2:] or ["deform_demo"])[0]
    if out in ("-h", "--help"):
        print(__doc__)
        sys.exit()
    if out.startswith("-"):
        sys.exit(__doc__)
    demo(command_path(), demo_scene(), pathlib.Path(out))
else:
    main()
