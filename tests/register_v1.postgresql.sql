SET statement_timeout = 0;
SET lock_timeout = 0;
SET idle_in_transaction_session_timeout = 0;
SET client_encoding = 'UTF8';
SET standard_conforming_strings = on;
SELECT pg_catalog.set_config('search_path', '', false);
SET check_function_bodies = false;
SET xmloption = content;
SET client_min_messages = warning;
SET row_security = off;
CREATE FUNCTION public.forcemap_keep() RETURNS trigger
    LANGUAGE plpgsql
    AS $$ begin raise exception 'a row of the register is never changed or deleted; enter what is new'; end $$;
SET default_tablespace = '';
SET default_table_access_method = heap;
CREATE TABLE public.alembic_version (
    version_num character varying(32) NOT NULL
);
CREATE TABLE public.audit (
    id bigint NOT NULL,
    at text NOT NULL,
    person text NOT NULL,
    login text NOT NULL,
    action text NOT NULL,
    subject text NOT NULL,
    content text NOT NULL,
    previous text NOT NULL,
    sha256 text NOT NULL
);
CREATE TABLE public.campaigns (
    id bigint NOT NULL,
    cell_id bigint,
    sha256 text NOT NULL,
    name text NOT NULL,
    folder text NOT NULL,
    binding text NOT NULL,
    conditions text NOT NULL,
    device text NOT NULL,
    measured_on text,
    calibrated text,
    calibrated_until text,
    "device_error_N" double precision,
    simulated integer NOT NULL,
    recordings integer NOT NULL,
    entry bigint NOT NULL
);
CREATE TABLE public.cells (
    id bigint NOT NULL,
    site text NOT NULL,
    name text NOT NULL,
    entry bigint NOT NULL
);
CREATE TABLE public.facts (
    id bigint NOT NULL,
    cell_id bigint NOT NULL,
    campaign_id bigint,
    kind text NOT NULL,
    since text NOT NULL,
    value text,
    entry bigint NOT NULL
);
CREATE TABLE public.impacts (
    id bigint NOT NULL,
    recording_id bigint NOT NULL,
    campaign_id bigint NOT NULL,
    curve text NOT NULL,
    state_id text NOT NULL,
    use text NOT NULL,
    flags text NOT NULL,
    distance_m double precision,
    height_m double precision,
    speed_mps double precision,
    "peak_force_N" double precision,
    "phase2_force_N" double precision,
    "largest_N" double precision,
    repeat integer NOT NULL,
    whole integer NOT NULL,
    entry bigint NOT NULL
);
CREATE TABLE public.maps (
    id bigint NOT NULL,
    campaign_id bigint NOT NULL,
    sha256 text NOT NULL,
    file text NOT NULL,
    form text NOT NULL,
    entry bigint NOT NULL
);
CREATE TABLE public.recordings (
    id bigint NOT NULL,
    sha256 text NOT NULL,
    size_bytes bigint NOT NULL,
    entry bigint NOT NULL
);
CREATE TABLE public.releases (
    id bigint NOT NULL,
    cell_id bigint NOT NULL,
    campaign_id bigint NOT NULL,
    subject text NOT NULL,
    areas text NOT NULL,
    contact text NOT NULL,
    bound text NOT NULL,
    speeds text NOT NULL,
    report_sha256 text NOT NULL,
    conditions text NOT NULL,
    person text NOT NULL,
    at text NOT NULL,
    map_sha256 text,
    valid_until text,
    measured_on text,
    calibrated text,
    calibrated_until text,
    "limit_N" double precision,
    "device_spring_N_per_m" double precision,
    "area_spring_N_per_m" double precision,
    simulated integer NOT NULL,
    replaces bigint,
    entry bigint NOT NULL
);
CREATE TABLE public.uses (
    id bigint NOT NULL,
    campaign_id bigint NOT NULL,
    impact_id bigint NOT NULL,
    file text NOT NULL,
    entry bigint NOT NULL
);
CREATE TABLE public.withdrawals (
    id bigint NOT NULL,
    release_id bigint NOT NULL,
    reason text NOT NULL,
    person text NOT NULL,
    at text NOT NULL,
    entry bigint NOT NULL
);
INSERT INTO public.alembic_version VALUES
	('v1');
INSERT INTO public.audit VALUES
	(1, '2026-11-23T16:26:52.619970Z', 'operator', 'owner', 'enter', 'campaign c38ed1fa758d0535ccd819258f751c7afe76621611c9a664bb18775ed9a9a278', '{"cell": "plant/cell-1", "facts": ["robot: UR10e, R-cell-1", "controller: CB5, C-cell-1", "firmware: 5.11", "safety_checksum: A1B2", "tool: gripper", "program: pick 3", "covers: none", "device: PFMD, D1"], "folder": "/plant/cell-1", "rows": {"campaigns": [1, "769fe88adbaea213683f53e962dfee8eee310e3021afd8b6d03e5cc122daaecf"], "cells": [1, "74a7d66d397fa623b7393cc4859e4c8cb32311182ae0a88a83d9d9a3e90e6fb1"], "facts": [8, "759ea745e4adda710938940d3afbe331594e724c63a25341f28888bd35a1c54d"], "impacts": [30, "701eee634bfec2ef5838821f5e20c6ed92e662057cbea4bde97c05f333425087"], "recordings": [30, "625d0d3d9d5b4bf02fcddfb062e6a23603643d128e0c89c59afe9b5b4d410d70"], "uses": [30, "cd7864bedd9b99382f682db6b20d2ad8f0114496945e985b2bb572c16b3410e2"]}}', '0000000000000000000000000000000000000000000000000000000000000000', '25cc0da0e0b7cee1f7c18b6540e87cec37e2de536463ea88475e7aef2e8d3eed'),
	(2, '2026-11-23T16:26:52.710944Z', 'operator', 'owner', 'enter', 'more', '{"rows": {"maps": [1, "5060aa49d9996ee52e8dd5fba0278e0c9e44d56986bfdf26c419143502ce9c71"]}}', '25cc0da0e0b7cee1f7c18b6540e87cec37e2de536463ea88475e7aef2e8d3eed', '164e3e4a132e1b66d5cd4c0d596b0d242b07b39727b594aaa95c5fe52e8e19fa'),
	(3, '2026-11-23T16:26:52.812555Z', 'operator', 'owner', 'release', 'release 1', '{"rows": {"releases": [1, "d3def77df3f57c728429c41d4f71c4d59e47f29edda4d3e8204313dff8d52eb5"]}}', '164e3e4a132e1b66d5cd4c0d596b0d242b07b39727b594aaa95c5fe52e8e19fa', '29ad24081ea8f606b28cfdca60b86e03c8fc581337b723209cd20a0d28a142ad'),
	(4, '2026-11-23T16:26:52.851930Z', 'operator', 'owner', 'withdraw', 'release 1', '{"reason": "x", "rows": {"withdrawals": [1, "570d7847ca4a821756e164a6c95b2466ac3ed0caa7466819dd08b403f99f7d67"]}}', '29ad24081ea8f606b28cfdca60b86e03c8fc581337b723209cd20a0d28a142ad', '1eba096ea0d5242985c5ef0bbe7f9ecf3f776b3a7d715783997e527e7df1fe32');
INSERT INTO public.campaigns VALUES
	(1, 1, 'c38ed1fa758d0535ccd819258f751c7afe76621611c9a664bb18775ed9a9a278', 'cell-1', '/plant/cell-1', 'bound', '{"robot": "UR10e, R-cell-1", "controller": "CB5, C-cell-1", "firmware": "5.11", "safety_checksum": "A1B2", "tool": "gripper", "program": "pick 3", "covers": "none", "device": "PFMD, D1"}', 'PFMD, D1', '2026-02-01', '2025-07-01', '2026-07-01', 3, 0, 30, 1);
INSERT INTO public.cells VALUES
	(1, 'plant', 'cell-1', 1);
INSERT INTO public.facts VALUES
	(1, 1, 1, 'robot', '2026-02-01T23:59:59.999999Z', 'UR10e, R-cell-1', 1),
	(2, 1, 1, 'controller', '2026-02-01T23:59:59.999999Z', 'CB5, C-cell-1', 1),
	(3, 1, 1, 'firmware', '2026-02-01T23:59:59.999999Z', '5.11', 1),
	(4, 1, 1, 'safety_checksum', '2026-02-01T23:59:59.999999Z', 'A1B2', 1),
	(5, 1, 1, 'tool', '2026-02-01T23:59:59.999999Z', 'gripper', 1),
	(6, 1, 1, 'program', '2026-02-01T23:59:59.999999Z', 'pick 3', 1),
	(7, 1, 1, 'covers', '2026-02-01T23:59:59.999999Z', 'none', 1),
	(8, 1, 1, 'device', '2026-02-01T23:59:59.999999Z', 'PFMD, D1', 1);
INSERT INTO public.impacts VALUES
	(1, 1, 1, '', 's00', 'used', '', 0.52, 0.14, 0.15, 200.19, 1.6, 200.19, 1, 1, 1),
	(2, 2, 1, '', 's01', 'used', '', 0.52, 0.14, 0.25, 279.71, 1.6, 279.71, 1, 1, 1),
	(3, 3, 1, '', 's02', 'used', '', 0.52, 0.14, 0.35, 358.01, 1.6, 358.01, 1, 1, 1),
	(4, 4, 1, '', 's03', 'used', '', 0.56, 0.29, 0.15, 141.37, 1.6, 141.37, 1, 1, 1),
	(5, 5, 1, '', 's04', 'used', '', 0.56, 0.29, 0.25, 200.49, 1.6, 200.49, 1, 1, 1),
	(6, 6, 1, '', 's05', 'used', '', 0.56, 0.29, 0.35, 255.88, 1.6, 255.88, 1, 1, 1),
	(7, 7, 1, '', 's06', 'used', '', 0.6, 0.44, 0.15, 98.77, 1.6, 98.77, 1, 1, 1),
	(8, 8, 1, '', 's07', 'used', '', 0.6, 0.44, 0.25, 143.12, 1.6, 143.12, 1, 1, 1),
	(9, 9, 1, '', 's08', 'used', '', 0.6, 0.44, 0.35, 179.17, 1.6, 179.17, 1, 1, 1),
	(10, 10, 1, '', 's09', 'used', '', 0.64, 0.24, 0.15, 134.05, 1.6, 134.05, 1, 1, 1),
	(11, 11, 1, '', 's10', 'used', '', 0.64, 0.24, 0.25, 194.98, 1.6, 194.98, 1, 1, 1),
	(12, 12, 1, '', 's11', 'used', '', 0.64, 0.24, 0.35, 255.82, 1.6, 255.82, 1, 1, 1),
	(13, 13, 1, '', 's12', 'used', '', 0.68, 0.39, 0.15, 98.02, 1.6, 98.02, 1, 1, 1),
	(14, 14, 1, '', 's13', 'used', '', 0.68, 0.39, 0.25, 138.98, 1.6, 138.98, 1, 1, 1),
	(15, 15, 1, '', 's14', 'used', '', 0.68, 0.39, 0.35, 188.74, 1.6, 188.74, 1, 1, 1),
	(16, 16, 1, '', 's15', 'used', '', 0.72, 0.19, 0.15, 123.93, 1.6, 123.93, 1, 1, 1),
	(17, 17, 1, '', 's16', 'used', '', 0.72, 0.19, 0.25, 175.5, 1.6, 175.5, 1, 1, 1),
	(18, 18, 1, '', 's17', 'used', '', 0.72, 0.19, 0.35, 237.89, 1.6, 237.89, 1, 1, 1),
	(19, 19, 1, '', 's18', 'used', '', 0.76, 0.34, 0.15, 89.21, 1.6, 89.21, 1, 1, 1),
	(20, 20, 1, '', 's19', 'used', '', 0.76, 0.34, 0.25, 135.33, 1.6, 135.33, 1, 1, 1),
	(21, 21, 1, '', 's20', 'used', '', 0.76, 0.34, 0.35, 179.54, 1.6, 179.54, 1, 1, 1),
	(22, 22, 1, '', 's21', 'used', '', 0.8, 0.14, 0.15, 107.75, 1.6, 107.75, 1, 1, 1),
	(23, 23, 1, '', 's22', 'used', '', 0.8, 0.14, 0.25, 159.61, 1.6, 159.61, 1, 1, 1),
	(24, 24, 1, '', 's23', 'used', '', 0.8, 0.14, 0.35, 225.22, 1.6, 225.22, 1, 1, 1),
	(25, 25, 1, '', 's24', 'used', '', 0.84, 0.29, 0.15, 84.21, 1.6, 84.21, 1, 1, 1),
	(26, 26, 1, '', 's25', 'used', '', 0.84, 0.29, 0.25, 128.41, 1.6, 128.41, 1, 1, 1),
	(27, 27, 1, '', 's26', 'used', '', 0.84, 0.29, 0.35, 168.74, 1.6, 168.74, 1, 1, 1),
	(28, 28, 1, '', 's27', 'used', '', 0.88, 0.44, 0.15, 68.3, 1.6, 68.3, 1, 1, 1),
	(29, 29, 1, '', 's28', 'used', '', 0.88, 0.44, 0.25, 107.83, 1.6, 107.83, 1, 1, 1),
	(30, 30, 1, '', 's29', 'used', '', 0.88, 0.44, 0.35, 149.96, 1.6, 149.96, 1, 1, 1);
INSERT INTO public.maps VALUES
	(1, 1, 'abababababababababababababababababababababababababababababababab', 'maps/a.json', 'CFM_3D', 2);
INSERT INTO public.recordings VALUES
	(1, '25028f42507c3ea5645152f0b12b217d012f55a64f31b36b9b404ae8e0eac6dd', 9, 1),
	(2, '5e967171711f3a9b709afa1ee1fb9048c7842287006cd189525d2e09f52695ab', 9, 1),
	(3, 'c60513aefd35e5a1fb5096c152dc12451ac4463f0147e8a0c49a383b51651537', 9, 1),
	(4, '4625afbf2aa208411e7975959f61282db8c698759cb5a7405a60fef9e3792994', 9, 1),
	(5, '54c8fcd4717d0d07780a42b6266a540e8bbbe552c3663b18ac542204a0823577', 9, 1),
	(6, '92c2355599d7878f31240474ad2fae0252d004fa8c2c073aad8ae4fe197dcff9', 9, 1),
	(7, '1a26618bd0e437299a6aeff094f27ef90de177209ef4ababb4186c5d79a79e71', 9, 1),
	(8, '03310e33a97f3d4e28891faafc2285e73c2d7d64cb1ea25bcd50374ed90e0d80', 9, 1),
	(9, 'b1d2acd0f737c969442f82bb03f1678c0fc15fa853516682aa65344d9e03921b', 9, 1),
	(10, '492f55a6d59e131c3e0762bdad451aeffc3bac8e57696ee64413173cabebd981', 9, 1),
	(11, '52c66b87772c9d6d22dd550fef709ce841a10dd2dd90e4a298ce9d079839df71', 9, 1),
	(12, '6d7d95f66daf6eefbf77d5abae1ac8fdab72eee1b40d883aeed366ae08fed80e', 9, 1),
	(13, 'cd34f96a5b39400039327ed30070175b77f96a7da3f21746e1ca486c5371985a', 9, 1),
	(14, '4389706d3ca67da8d3db4e9d2b519eac8fea5ce76797a005e359f554f0728f5c', 9, 1),
	(15, 'cd138d5f8a45af491ad8fe9d1d4db687d070e5e8b2eb92b1e25f4f06e13d7e8c', 9, 1),
	(16, '0d7015968f5816eefc87f5fd7cb3ff75894a1b839630344caf2fc0c2c14f0b2b', 9, 1),
	(17, '0410c6913305fc7f2c5b103b5d455c8f90985cb6d78a1ae49c58e557b3f0dec8', 9, 1),
	(18, 'ad27cedc2897853563d9c75e40793df5456b1a53a8403c83c10f8a9fc3a8efec', 9, 1),
	(19, '4c17ca6a2748dbc8797a67f16801db3da463d438303716c8a07b35ff6c099409', 9, 1),
	(20, 'de79ddc7b08e38bf2f0e9a5a668dfe361ff2da616c17626aea5a7d87aee6550a', 9, 1),
	(21, 'f70d5b004f104b3fccf77117c54b1f60164f8c87caaeac53ded633536f18f389', 9, 1),
	(22, '4a900707aed8b6332b62dfb08e166107aaecdf701d06b7784804fa5b303df39b', 9, 1),
	(23, '1a6b2ea1b675e79b09c06a08d9fec684e62e6cca2237c7b036413be10818ff95', 9, 1),
	(24, '80714d4155802d78f56cb656e04bf9f8ccaece2affc516243c2f2d6b0eafe6f4', 9, 1),
	(25, '8a654693aa51c3c689c250a81aad712d5b87af772518a67e2ad7ec391f17d06f', 9, 1),
	(26, 'b7344969858798773153deea8f46b97c1736289c139f651f1c98c5510c6a5d2d', 9, 1),
	(27, '7c5bfb6a0a17c6caca439c7de7c2c22d8558ef5abead1cc7f72522708a0090a3', 9, 1),
	(28, 'f5a833d7c4d23cc7012f02b588dcf94f1eb114afff446178bf56d646c9ecb2cc', 9, 1),
	(29, '38d50ec028ea36d57757c85cfccba55c60b7de9eb547382f5cd9543e23079344', 9, 1),
	(30, '9e4bf8f3d77e60831c50dd3532e5dc43d01dfc30ba7b88772dd3c89897a8769a', 9, 1);
INSERT INTO public.releases VALUES
	(1, 1, 1, 'workspace', 'chest', 'transient', 'b', '{}', '0000000000000000000000000000000000000000000000000000000000000000', '{"robot": "UR10e, R-cell-1", "controller": "CB5, C-cell-1", "firmware": "5.11", "safety_checksum": "A1B2", "tool": "gripper", "program": "pick 3", "covers": "none", "device": "PFMD, D1"}', 'operator', '2026-11-23T16:26:52.812555Z', 'abababababababababababababababababababababababababababababababab', '2027-09-19', '2026-02-01', NULL, '2026-12-31', 280, 75000, 25000, 0, NULL, 3);
INSERT INTO public.uses VALUES
	(1, 1, 1, 's00-r1.csv', 1),
	(2, 1, 2, 's01-r1.csv', 1),
	(3, 1, 3, 's02-r1.csv', 1),
	(4, 1, 4, 's03-r1.csv', 1),
	(5, 1, 5, 's04-r1.csv', 1),
	(6, 1, 6, 's05-r1.csv', 1),
	(7, 1, 7, 's06-r1.csv', 1),
	(8, 1, 8, 's07-r1.csv', 1),
	(9, 1, 9, 's08-r1.csv', 1),
	(10, 1, 10, 's09-r1.csv', 1),
	(11, 1, 11, 's10-r1.csv', 1),
	(12, 1, 12, 's11-r1.csv', 1),
	(13, 1, 13, 's12-r1.csv', 1),
	(14, 1, 14, 's13-r1.csv', 1),
	(15, 1, 15, 's14-r1.csv', 1),
	(16, 1, 16, 's15-r1.csv', 1),
	(17, 1, 17, 's16-r1.csv', 1),
	(18, 1, 18, 's17-r1.csv', 1),
	(19, 1, 19, 's18-r1.csv', 1),
	(20, 1, 20, 's19-r1.csv', 1),
	(21, 1, 21, 's20-r1.csv', 1),
	(22, 1, 22, 's21-r1.csv', 1),
	(23, 1, 23, 's22-r1.csv', 1),
	(24, 1, 24, 's23-r1.csv', 1),
	(25, 1, 25, 's24-r1.csv', 1),
	(26, 1, 26, 's25-r1.csv', 1),
	(27, 1, 27, 's26-r1.csv', 1),
	(28, 1, 28, 's27-r1.csv', 1),
	(29, 1, 29, 's28-r1.csv', 1),
	(30, 1, 30, 's29-r1.csv', 1);
INSERT INTO public.withdrawals VALUES
	(1, 1, 'x', 'operator', '2026-11-23T16:26:52.851930Z', 4);
ALTER TABLE ONLY public.alembic_version
    ADD CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num);
ALTER TABLE ONLY public.audit
    ADD CONSTRAINT audit_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.audit
    ADD CONSTRAINT audit_previous UNIQUE (previous);
ALTER TABLE ONLY public.campaigns
    ADD CONSTRAINT campaigns_content UNIQUE (sha256, cell_id);
ALTER TABLE ONLY public.campaigns
    ADD CONSTRAINT campaigns_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.cells
    ADD CONSTRAINT cells_name UNIQUE (site, name);
ALTER TABLE ONLY public.cells
    ADD CONSTRAINT cells_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.facts
    ADD CONSTRAINT facts_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.impacts
    ADD CONSTRAINT impacts_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.maps
    ADD CONSTRAINT maps_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.recordings
    ADD CONSTRAINT recordings_content UNIQUE (sha256);
ALTER TABLE ONLY public.recordings
    ADD CONSTRAINT recordings_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.releases
    ADD CONSTRAINT releases_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.releases
    ADD CONSTRAINT releases_replaces UNIQUE (replaces);
ALTER TABLE ONLY public.uses
    ADD CONSTRAINT uses_pkey PRIMARY KEY (id);
ALTER TABLE ONLY public.withdrawals
    ADD CONSTRAINT withdrawals_pkey PRIMARY KEY (id);
CREATE INDEX campaigns_cell ON public.campaigns USING btree (cell_id);
CREATE INDEX facts_cell ON public.facts USING btree (cell_id, kind);
CREATE INDEX facts_value ON public.facts USING btree (kind, value);
CREATE INDEX impacts_recording ON public.impacts USING btree (recording_id);
CREATE INDEX maps_sha256 ON public.maps USING btree (sha256);
CREATE INDEX releases_cell ON public.releases USING btree (cell_id);
CREATE INDEX releases_map ON public.releases USING btree (map_sha256);
CREATE INDEX uses_campaign ON public.uses USING btree (campaign_id);
CREATE INDEX uses_impact ON public.uses USING btree (impact_id);
CREATE INDEX withdrawals_release ON public.withdrawals USING btree (release_id);
CREATE TRIGGER audit_kept_row BEFORE DELETE OR UPDATE ON public.audit FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER audit_kept_statement BEFORE TRUNCATE ON public.audit FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER campaigns_kept_row BEFORE DELETE OR UPDATE ON public.campaigns FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER campaigns_kept_statement BEFORE TRUNCATE ON public.campaigns FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER cells_kept_row BEFORE DELETE OR UPDATE ON public.cells FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER cells_kept_statement BEFORE TRUNCATE ON public.cells FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER facts_kept_row BEFORE DELETE OR UPDATE ON public.facts FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER facts_kept_statement BEFORE TRUNCATE ON public.facts FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER impacts_kept_row BEFORE DELETE OR UPDATE ON public.impacts FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER impacts_kept_statement BEFORE TRUNCATE ON public.impacts FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER maps_kept_row BEFORE DELETE OR UPDATE ON public.maps FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER maps_kept_statement BEFORE TRUNCATE ON public.maps FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER recordings_kept_row BEFORE DELETE OR UPDATE ON public.recordings FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER recordings_kept_statement BEFORE TRUNCATE ON public.recordings FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER releases_kept_row BEFORE DELETE OR UPDATE ON public.releases FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER releases_kept_statement BEFORE TRUNCATE ON public.releases FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER uses_kept_row BEFORE DELETE OR UPDATE ON public.uses FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER uses_kept_statement BEFORE TRUNCATE ON public.uses FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER withdrawals_kept_row BEFORE DELETE OR UPDATE ON public.withdrawals FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER withdrawals_kept_statement BEFORE TRUNCATE ON public.withdrawals FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
ALTER TABLE ONLY public.campaigns
    ADD CONSTRAINT campaigns_cell_id_fkey FOREIGN KEY (cell_id) REFERENCES public.cells(id);
ALTER TABLE ONLY public.campaigns
    ADD CONSTRAINT campaigns_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
ALTER TABLE ONLY public.cells
    ADD CONSTRAINT cells_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
ALTER TABLE ONLY public.facts
    ADD CONSTRAINT facts_campaign_id_fkey FOREIGN KEY (campaign_id) REFERENCES public.campaigns(id);
ALTER TABLE ONLY public.facts
    ADD CONSTRAINT facts_cell_id_fkey FOREIGN KEY (cell_id) REFERENCES public.cells(id);
ALTER TABLE ONLY public.facts
    ADD CONSTRAINT facts_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
ALTER TABLE ONLY public.impacts
    ADD CONSTRAINT impacts_campaign_id_fkey FOREIGN KEY (campaign_id) REFERENCES public.campaigns(id);
ALTER TABLE ONLY public.impacts
    ADD CONSTRAINT impacts_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
ALTER TABLE ONLY public.impacts
    ADD CONSTRAINT impacts_recording_id_fkey FOREIGN KEY (recording_id) REFERENCES public.recordings(id);
ALTER TABLE ONLY public.maps
    ADD CONSTRAINT maps_campaign_id_fkey FOREIGN KEY (campaign_id) REFERENCES public.campaigns(id);
ALTER TABLE ONLY public.maps
    ADD CONSTRAINT maps_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
ALTER TABLE ONLY public.recordings
    ADD CONSTRAINT recordings_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
ALTER TABLE ONLY public.releases
    ADD CONSTRAINT releases_campaign_id_fkey FOREIGN KEY (campaign_id) REFERENCES public.campaigns(id);
ALTER TABLE ONLY public.releases
    ADD CONSTRAINT releases_cell_id_fkey FOREIGN KEY (cell_id) REFERENCES public.cells(id);
ALTER TABLE ONLY public.releases
    ADD CONSTRAINT releases_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
ALTER TABLE ONLY public.releases
    ADD CONSTRAINT releases_replaces_fkey FOREIGN KEY (replaces) REFERENCES public.releases(id);
ALTER TABLE ONLY public.uses
    ADD CONSTRAINT uses_campaign_id_fkey FOREIGN KEY (campaign_id) REFERENCES public.campaigns(id);
ALTER TABLE ONLY public.uses
    ADD CONSTRAINT uses_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
ALTER TABLE ONLY public.uses
    ADD CONSTRAINT uses_impact_id_fkey FOREIGN KEY (impact_id) REFERENCES public.impacts(id);
ALTER TABLE ONLY public.withdrawals
    ADD CONSTRAINT withdrawals_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
ALTER TABLE ONLY public.withdrawals
    ADD CONSTRAINT withdrawals_release_id_fkey FOREIGN KEY (release_id) REFERENCES public.releases(id);
