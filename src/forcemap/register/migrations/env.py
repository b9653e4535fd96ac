"""What Alembic runs: the migrations, in the transaction of `forcemap.register.schema`."""

from alembic import context

from forcemap.register.tables import METADATA

context.configure(connection=context.config.attributes["connection"], target_metadata=METADATA)
context.run_migrations()
