"""Pages of docs/ that are made, or held, against what the program does.

python -m pages.commands     docs/commands.md from the commands themselves
python -m pages.effects      pictures and facts of docs/effects/
python -m pages.tutorial     outputs and pictures of docs/tutorial.md
"""
