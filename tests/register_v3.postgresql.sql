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
CREATE FUNCTION public.forcemap_follow_audit() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$ begin if new.id is distinct from (select coalesce(max(id), 0) + 1 from public.audit) or new.previous is distinct from coalesce((select sha256 from public.audit order by id desc limit 1), '0000000000000000000000000000000000000000000000000000000000000000') or session_user::text is distinct from new.login then raise exception 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'; end if; return new; end $$;
CREATE FUNCTION public.forcemap_follow_campaigns() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$ begin if new.id is distinct from (select coalesce(max(id), 0) + 1 from public.campaigns) or new.entry is distinct from (select max(id) from public.audit) or session_user::text is distinct from (select login from public.audit where id = new.entry) then raise exception 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'; end if; return new; end $$;
CREATE FUNCTION public.forcemap_follow_cells() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$ begin if new.id is distinct from (select coalesce(max(id), 0) + 1 from public.cells) or new.entry is distinct from (select max(id) from public.audit) or session_user::text is distinct from (select login from public.audit where id = new.entry) then raise exception 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'; end if; return new; end $$;
CREATE FUNCTION public.forcemap_follow_contact_points() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$ begin if new.id is distinct from (select coalesce(max(id), 0) + 1 from public.contact_points) or new.entry is distinct from (select max(id) from public.audit) or session_user::text is distinct from (select login from public.audit where id = new.entry) then raise exception 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'; end if; return new; end $$;
CREATE FUNCTION public.forcemap_follow_facts() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$ begin if new.id is distinct from (select coalesce(max(id), 0) + 1 from public.facts) or new.entry is distinct from (select max(id) from public.audit) or session_user::text is distinct from (select login from public.audit where id = new.entry) then raise exception 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'; end if; return new; end $$;
CREATE FUNCTION public.forcemap_follow_impacts() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$ begin if new.id is distinct from (select coalesce(max(id), 0) + 1 from public.impacts) or new.entry is distinct from (select max(id) from public.audit) or session_user::text is distinct from (select login from public.audit where id = new.entry) then raise exception 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'; end if; return new; end $$;
CREATE FUNCTION public.forcemap_follow_maps() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$ begin if new.id is distinct from (select coalesce(max(id), 0) + 1 from public.maps) or new.entry is distinct from (select max(id) from public.audit) or session_user::text is distinct from (select login from public.audit where id = new.entry) then raise exception 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'; end if; return new; end $$;
CREATE FUNCTION public.forcemap_follow_recordings() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$ begin if new.id is distinct from (select coalesce(max(id), 0) + 1 from public.recordings) or new.entry is distinct from (select max(id) from public.audit) or session_user::text is distinct from (select login from public.audit where id = new.entry) then raise exception 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'; end if; return new; end $$;
CREATE FUNCTION public.forcemap_follow_releases() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$ begin if new.id is distinct from (select coalesce(max(id), 0) + 1 from public.releases) or new.entry is distinct from (select max(id) from public.audit) or session_user::text is distinct from (select login from public.audit where id = new.entry) then raise exception 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'; end if; return new; end $$;
CREATE FUNCTION public.forcemap_follow_uses() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$ begin if new.id is distinct from (select coalesce(max(id), 0) + 1 from public.uses) or new.entry is distinct from (select max(id) from public.audit) or session_user::text is distinct from (select login from public.audit where id = new.entry) then raise exception 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'; end if; return new; end $$;
CREATE FUNCTION public.forcemap_follow_withdrawals() RETURNS trigger
    LANGUAGE plpgsql
    SET search_path TO 'pg_catalog', 'pg_temp'
    AS $$ begin if new.id is distinct from (select coalesce(max(id), 0) + 1 from public.withdrawals) or new.entry is distinct from (select max(id) from public.audit) or session_user::text is distinct from (select login from public.audit where id = new.entry) then raise exception 'a row of the register is never changed or deleted; a new one follows the newest, of the account that enters it'; end if; return new; end $$;
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
CREATE TABLE public.contact_points (
    id bigint NOT NULL,
    campaign_id bigint NOT NULL,
    name text NOT NULL,
    area text NOT NULL,
    contact text NOT NULL,
    rests_on text NOT NULL,
    programmed_mps double precision,
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
INSERT INTO public.alembic_version VALUES ('v3');
INSERT INTO public.audit VALUES (1, '2026-11-23T20:12:21.710962Z', 'operator', 'owner', 'enter', 'campaign c6c569c69dc71848b9650dbc51ce619583806c2902a14e744c49c53a729cd9df', '{"cell": "plant/cell-1", "facts": ["robot: UR10e, R-cell-1", "controller: CB5, C-cell-1", "firmware: 5.11", "safety_checksum: A1B2", "tool: gripper", "program: pick 3", "covers: none", "device: PFMD, D1"], "folder": "/plant/cell-1", "rows": {"campaigns": [1, "9a070f5fb59f386bb6a3760cc70ed934f26ddb08a730851566f09ec77d739c04"], "cells": [1, "74a7d66d397fa623b7393cc4859e4c8cb32311182ae0a88a83d9d9a3e90e6fb1"], "facts": [8, "759ea745e4adda710938940d3afbe331594e724c63a25341f28888bd35a1c54d"], "impacts": [30, "5797a5a5d460563d0e7653efda1a4d6bde2abc08778b5a6776de1e16294fe01c"], "recordings": [30, "e1ffedb2387ec5d1fbf087c0c4acbacc8426d3f5a2548bda76867e41bab1a203"], "uses": [30, "cd7864bedd9b99382f682db6b20d2ad8f0114496945e985b2bb572c16b3410e2"]}}', '0000000000000000000000000000000000000000000000000000000000000000', '8b95c9db1bbe9ef3e6a9bdad69a985e18ee1f88ec8ab7308e565604c83f47e8e');
INSERT INTO public.audit VALUES (2, '2026-11-23T20:12:21.771387Z', 'operator', 'owner', 'enter', 'more', '{"rows": {"contact_points": [1, "64c03d319f43873f9ec0155f827f467895f299d27b625192470a6de302b6e58f"], "maps": [1, "5060aa49d9996ee52e8dd5fba0278e0c9e44d56986bfdf26c419143502ce9c71"]}}', '8b95c9db1bbe9ef3e6a9bdad69a985e18ee1f88ec8ab7308e565604c83f47e8e', 'da1b7b9f8458ad5b8671f495179cb7dd3f4ea8482f55b2f8ea4a1f98a69f06d6');
INSERT INTO public.audit VALUES (3, '2026-11-23T20:12:21.804573Z', 'operator', 'owner', 'release', 'release 1', '{"rows": {"releases": [1, "4cc27ceabddebdd860556e8f435387361e8dc53d5b7e769b5d2862372dcfc645"]}}', 'da1b7b9f8458ad5b8671f495179cb7dd3f4ea8482f55b2f8ea4a1f98a69f06d6', '96c39e140a30b2c49e60fed32194ef6e706a4330aa21e7ab59bb4ec700e50f9d');
INSERT INTO public.audit VALUES (4, '2026-11-23T20:12:21.818310Z', 'operator', 'owner', 'withdraw', 'release 1', '{"reason": "x", "rows": {"withdrawals": [1, "50eefa59081d3edecf2e8dd00fecbdfc19dee3c04a00d3783d28397825e0f54c"]}}', '96c39e140a30b2c49e60fed32194ef6e706a4330aa21e7ab59bb4ec700e50f9d', '10714f77a05a5725b287025900509dac00bd2c5689a213c881f00e2eb3b949d0');
INSERT INTO public.campaigns VALUES (1, 1, 'c6c569c69dc71848b9650dbc51ce619583806c2902a14e744c49c53a729cd9df', 'cell-1', '/plant/cell-1', 'bound', '{"robot": "UR10e, R-cell-1", "controller": "CB5, C-cell-1", "firmware": "5.11", "safety_checksum": "A1B2", "tool": "gripper", "program": "pick 3", "covers": "none", "device": "PFMD, D1"}', 'PFMD, D1', '2026-02-01', '2025-07-01', '2026-07-01', 3, 0, 30, 1);
INSERT INTO public.cells VALUES (1, 'plant', 'cell-1', 1);
INSERT INTO public.contact_points VALUES (1, 1, 'P1', 'chest', 'transient', 'map', 0.25, 2);
INSERT INTO public.facts VALUES (1, 1, 1, 'robot', '2026-02-01T23:59:59.999999Z', 'UR10e, R-cell-1', 1);
INSERT INTO public.facts VALUES (2, 1, 1, 'controller', '2026-02-01T23:59:59.999999Z', 'CB5, C-cell-1', 1);
INSERT INTO public.facts VALUES (3, 1, 1, 'firmware', '2026-02-01T23:59:59.999999Z', '5.11', 1);
INSERT INTO public.facts VALUES (4, 1, 1, 'safety_checksum', '2026-02-01T23:59:59.999999Z', 'A1B2', 1);
INSERT INTO public.facts VALUES (5, 1, 1, 'tool', '2026-02-01T23:59:59.999999Z', 'gripper', 1);
INSERT INTO public.facts VALUES (6, 1, 1, 'program', '2026-02-01T23:59:59.999999Z', 'pick 3', 1);
INSERT INTO public.facts VALUES (7, 1, 1, 'covers', '2026-02-01T23:59:59.999999Z', 'none', 1);
INSERT INTO public.facts VALUES (8, 1, 1, 'device', '2026-02-01T23:59:59.999999Z', 'PFMD, D1', 1);
INSERT INTO public.impacts VALUES (1, 1, 1, '', 's00', 'used', '', 0.52, 0.14, 0.15, 205.28, 1.6, 205.28, 1, 1, 1);
INSERT INTO public.impacts VALUES (2, 2, 1, '', 's01', 'used', '', 0.52, 0.14, 0.25, 281.75, 1.6, 281.75, 1, 1, 1);
INSERT INTO public.impacts VALUES (3, 3, 1, '', 's02', 'used', '', 0.52, 0.14, 0.35, 363.45, 1.6, 363.45, 1, 1, 1);
INSERT INTO public.impacts VALUES (4, 4, 1, '', 's03', 'used', '', 0.56, 0.29, 0.15, 142.22, 1.6, 142.22, 1, 1, 1);
INSERT INTO public.impacts VALUES (5, 5, 1, '', 's04', 'used', '', 0.56, 0.29, 0.25, 205.59, 1.6, 205.59, 1, 1, 1);
INSERT INTO public.impacts VALUES (6, 6, 1, '', 's05', 'used', '', 0.56, 0.29, 0.35, 265.29, 1.6, 265.29, 1, 1, 1);
INSERT INTO public.impacts VALUES (7, 7, 1, '', 's06', 'used', '', 0.6, 0.44, 0.15, 97.37, 1.6, 97.37, 1, 1, 1);
INSERT INTO public.impacts VALUES (8, 8, 1, '', 's07', 'used', '', 0.6, 0.44, 0.25, 139.19, 1.6, 139.19, 1, 1, 1);
INSERT INTO public.impacts VALUES (9, 9, 1, '', 's08', 'used', '', 0.6, 0.44, 0.35, 182.95, 1.6, 182.95, 1, 1, 1);
INSERT INTO public.impacts VALUES (10, 10, 1, '', 's09', 'used', '', 0.64, 0.24, 0.15, 136.67, 1.6, 136.67, 1, 1, 1);
INSERT INTO public.impacts VALUES (11, 11, 1, '', 's10', 'used', '', 0.64, 0.24, 0.25, 191.9, 1.6, 191.9, 1, 1, 1);
INSERT INTO public.impacts VALUES (12, 12, 1, '', 's11', 'used', '', 0.64, 0.24, 0.35, 255.84, 1.6, 255.84, 1, 1, 1);
INSERT INTO public.impacts VALUES (13, 13, 1, '', 's12', 'used', '', 0.68, 0.39, 0.15, 96.94, 1.6, 96.94, 1, 1, 1);
INSERT INTO public.impacts VALUES (14, 14, 1, '', 's13', 'used', '', 0.68, 0.39, 0.25, 140.41, 1.6, 140.41, 1, 1, 1);
INSERT INTO public.impacts VALUES (15, 15, 1, '', 's14', 'used', '', 0.68, 0.39, 0.35, 185.69, 1.6, 185.69, 1, 1, 1);
INSERT INTO public.impacts VALUES (16, 16, 1, '', 's15', 'used', '', 0.72, 0.19, 0.15, 124.71, 1.6, 124.71, 1, 1, 1);
INSERT INTO public.impacts VALUES (17, 17, 1, '', 's16', 'used', '', 0.72, 0.19, 0.25, 179.68, 1.6, 179.68, 1, 1, 1);
INSERT INTO public.impacts VALUES (18, 18, 1, '', 's17', 'used', '', 0.72, 0.19, 0.35, 237.93, 1.6, 237.93, 1, 1, 1);
INSERT INTO public.impacts VALUES (19, 19, 1, '', 's18', 'used', '', 0.76, 0.34, 0.15, 91.79, 1.6, 91.79, 1, 1, 1);
INSERT INTO public.impacts VALUES (20, 20, 1, '', 's19', 'used', '', 0.76, 0.34, 0.25, 137.39, 1.6, 137.39, 1, 1, 1);
INSERT INTO public.impacts VALUES (21, 21, 1, '', 's20', 'used', '', 0.76, 0.34, 0.35, 185.9, 1.6, 185.9, 1, 1, 1);
INSERT INTO public.impacts VALUES (22, 22, 1, '', 's21', 'used', '', 0.8, 0.14, 0.15, 107.87, 1.6, 107.87, 1, 1, 1);
INSERT INTO public.impacts VALUES (23, 23, 1, '', 's22', 'used', '', 0.8, 0.14, 0.25, 168.55, 1.6, 168.55, 1, 1, 1);
INSERT INTO public.impacts VALUES (24, 24, 1, '', 's23', 'used', '', 0.8, 0.14, 0.35, 227.33, 1.6, 227.33, 1, 1, 1);
INSERT INTO public.impacts VALUES (25, 25, 1, '', 's24', 'used', '', 0.84, 0.29, 0.15, 79.94, 1.6, 79.94, 1, 1, 1);
INSERT INTO public.impacts VALUES (26, 26, 1, '', 's25', 'used', '', 0.84, 0.29, 0.25, 123.03, 1.6, 123.03, 1, 1, 1);
INSERT INTO public.impacts VALUES (27, 27, 1, '', 's26', 'used', '', 0.84, 0.29, 0.35, 177.71, 1.6, 177.71, 1, 1, 1);
INSERT INTO public.impacts VALUES (28, 28, 1, '', 's27', 'used', '', 0.88, 0.44, 0.15, 68.22, 1.6, 68.22, 1, 1, 1);
INSERT INTO public.impacts VALUES (29, 29, 1, '', 's28', 'used', '', 0.88, 0.44, 0.25, 106.95, 1.6, 106.95, 1, 1, 1);
INSERT INTO public.impacts VALUES (30, 30, 1, '', 's29', 'used', '', 0.88, 0.44, 0.35, 150.55, 1.6, 150.55, 1, 1, 1);
INSERT INTO public.maps VALUES (1, 1, 'abababababababababababababababababababababababababababababababab', 'maps/a.json', 'CFM_3D', 2);
INSERT INTO public.recordings VALUES (1, '1c9e43e44d366ec7e0a9256cc151e60dd0e8abf6e8f7df4fdcd86fb02ab73bf2', 9, 1);
INSERT INTO public.recordings VALUES (2, 'a66a7362d701640e8f484f39f5127aad501589073dae680ffdac5e23af0c6687', 9, 1);
INSERT INTO public.recordings VALUES (3, 'cc2500748302269960941ff14d0e628c558092cc7c082c73a1a6240fa2d29c9c', 9, 1);
INSERT INTO public.recordings VALUES (4, 'ffc606c258f29140605485c83726bacfe7c3dd1e1b129d9b5ec5daef757029d6', 9, 1);
INSERT INTO public.recordings VALUES (5, '6943baebddb7d430a675777acd7b81e6335cf0e814ca0743fccb5fe9eb9849fe', 9, 1);
INSERT INTO public.recordings VALUES (6, '8310c02e3434436985ce11a9f3f4c74704a63efcdb99978f76a7660c5cfa6902', 9, 1);
INSERT INTO public.recordings VALUES (7, '7c31c95098e698b6a029f1afa9ed61a8ab11fd279e44c215cc399a4d695eeb72', 9, 1);
INSERT INTO public.recordings VALUES (8, 'e4e212595c64307a366c69d768ed57142ccc5b6365079c60fb9e85fdb87888ec', 9, 1);
INSERT INTO public.recordings VALUES (9, '84c5e3a9caf7911fb9e24013e20a0c50baaf485baf223ff330e703c6d4c49ab8', 9, 1);
INSERT INTO public.recordings VALUES (10, '413b170a5ae4616d7d9edefc5e364a58f1ec16271aaeca4e9ba9143a03bed1d6', 9, 1);
INSERT INTO public.recordings VALUES (11, '158268579e4b88f710c4a706b21e1e215024a6535685abad5236ccec90bbf9dd', 9, 1);
INSERT INTO public.recordings VALUES (12, '580cdb67aaf2c83a1549493892d3ccb5418257a8129b488d41d99adc108612f9', 9, 1);
INSERT INTO public.recordings VALUES (13, '385412b1d99273e3b41338324bcc4c3cab84acfdc8c4a0bc4f9d73538cb1b051', 9, 1);
INSERT INTO public.recordings VALUES (14, '10336d9596c95b5485945b0c3d841a94cb34f881007962bdb723db5e2b237ff1', 9, 1);
INSERT INTO public.recordings VALUES (15, 'c0ba6bae86f550192aba1f837e33eabd2d6a95e2d8fcd4c586f138e1b977d632', 9, 1);
INSERT INTO public.recordings VALUES (16, 'b8147e17c543464beb9228d9c05da365a1b4d89abfb82ebcfa507f1296ae62f3', 9, 1);
INSERT INTO public.recordings VALUES (17, '1a1fba22883982518ac8aa78b1ab03e0f3fd2650ad6e87e50d27eb20093e45e0', 9, 1);
INSERT INTO public.recordings VALUES (18, '33f817295a7095bf481be879559b782ec68f1a19321685864d00ef96214d6533', 9, 1);
INSERT INTO public.recordings VALUES (19, 'cb2f84ebf5b3cb10b874e07dd0ade7ddd4b45fdabe3d37957e06505f4dd87541', 9, 1);
INSERT INTO public.recordings VALUES (20, '8821ee7897a5b9914e340cf35d59b0822d2d8d1925e21e3a44962115f85f758f', 9, 1);
INSERT INTO public.recordings VALUES (21, '80eaf86b061c18a5c0ff59f6569f4b51941ff93693079ec06f8c91eb9c941d40', 9, 1);
INSERT INTO public.recordings VALUES (22, 'ec79c842242858409ebecba9197879846c7761a0aeecd3a5bc3c8852ebe00e30', 9, 1);
INSERT INTO public.recordings VALUES (23, 'a6e938636ffedbd06d38c704032779a994b5defa285358e1e78d069b344b5cf3', 9, 1);
INSERT INTO public.recordings VALUES (24, '7269bc528186796c777c5c557ae095bcb85084217eb27a7f4be74121466af186', 9, 1);
INSERT INTO public.recordings VALUES (25, '5c677cfec6986e2e9aa78286f18b3c6857759d2668f0a792e0a4f729f2be255d', 9, 1);
INSERT INTO public.recordings VALUES (26, '41cdc4a5c98eca0958857524b83c70d0f4d41a27e47fd52c3957f2388e835589', 9, 1);
INSERT INTO public.recordings VALUES (27, '2b292db3e2f4deda2914fa964153aaa1e1fa4f36826b2b1f40cb4d37e2fb0edf', 9, 1);
INSERT INTO public.recordings VALUES (28, '9c85cccea81f6312d966368159b9701e1c6f513cdce29f2e3cb2fed81b98db21', 9, 1);
INSERT INTO public.recordings VALUES (29, '52b2f7218f73d52edce3844c1a4cbeeaccd65eca22609f1a39fbc852950116ff', 9, 1);
INSERT INTO public.recordings VALUES (30, '9425a907c657a084ee4c386408102985cf875a6d4056825c13a98144af310545', 9, 1);
INSERT INTO public.releases VALUES (1, 1, 1, 'workspace', 'chest', 'transient', 'b', '{"lowest_to_program_mps": 0.1, "highest_to_program_mps": 0.2}', '0000000000000000000000000000000000000000000000000000000000000000', '{"robot": "UR10e, R-cell-1", "controller": "CB5, C-cell-1", "firmware": "5.11", "safety_checksum": "A1B2", "tool": "gripper", "program": "pick 3", "covers": "none", "device": "PFMD, D1"}', 'operator', '2026-11-23T20:12:21.804573Z', 'abababababababababababababababababababababababababababababababab', '2027-09-19', '2026-02-01', NULL, '2026-12-31', 280, 75000, 25000, 0, NULL, 3);
INSERT INTO public.uses VALUES (1, 1, 1, 's00-r1.csv', 1);
INSERT INTO public.uses VALUES (2, 1, 2, 's01-r1.csv', 1);
INSERT INTO public.uses VALUES (3, 1, 3, 's02-r1.csv', 1);
INSERT INTO public.uses VALUES (4, 1, 4, 's03-r1.csv', 1);
INSERT INTO public.uses VALUES (5, 1, 5, 's04-r1.csv', 1);
INSERT INTO public.uses VALUES (6, 1, 6, 's05-r1.csv', 1);
INSERT INTO public.uses VALUES (7, 1, 7, 's06-r1.csv', 1);
INSERT INTO public.uses VALUES (8, 1, 8, 's07-r1.csv', 1);
INSERT INTO public.uses VALUES (9, 1, 9, 's08-r1.csv', 1);
INSERT INTO public.uses VALUES (10, 1, 10, 's09-r1.csv', 1);
INSERT INTO public.uses VALUES (11, 1, 11, 's10-r1.csv', 1);
INSERT INTO public.uses VALUES (12, 1, 12, 's11-r1.csv', 1);
INSERT INTO public.uses VALUES (13, 1, 13, 's12-r1.csv', 1);
INSERT INTO public.uses VALUES (14, 1, 14, 's13-r1.csv', 1);
INSERT INTO public.uses VALUES (15, 1, 15, 's14-r1.csv', 1);
INSERT INTO public.uses VALUES (16, 1, 16, 's15-r1.csv', 1);
INSERT INTO public.uses VALUES (17, 1, 17, 's16-r1.csv', 1);
INSERT INTO public.uses VALUES (18, 1, 18, 's17-r1.csv', 1);
INSERT INTO public.uses VALUES (19, 1, 19, 's18-r1.csv', 1);
INSERT INTO public.uses VALUES (20, 1, 20, 's19-r1.csv', 1);
INSERT INTO public.uses VALUES (21, 1, 21, 's20-r1.csv', 1);
INSERT INTO public.uses VALUES (22, 1, 22, 's21-r1.csv', 1);
INSERT INTO public.uses VALUES (23, 1, 23, 's22-r1.csv', 1);
INSERT INTO public.uses VALUES (24, 1, 24, 's23-r1.csv', 1);
INSERT INTO public.uses VALUES (25, 1, 25, 's24-r1.csv', 1);
INSERT INTO public.uses VALUES (26, 1, 26, 's25-r1.csv', 1);
INSERT INTO public.uses VALUES (27, 1, 27, 's26-r1.csv', 1);
INSERT INTO public.uses VALUES (28, 1, 28, 's27-r1.csv', 1);
INSERT INTO public.uses VALUES (29, 1, 29, 's28-r1.csv', 1);
INSERT INTO public.uses VALUES (30, 1, 30, 's29-r1.csv', 1);
INSERT INTO public.withdrawals VALUES (1, 1, 'x', 'operator', '2026-11-23T20:12:21.818310Z', 4);
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
ALTER TABLE ONLY public.contact_points
    ADD CONSTRAINT contact_points_pkey PRIMARY KEY (id);
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
CREATE INDEX campaigns_device ON public.campaigns USING btree (device);
CREATE INDEX contact_points_campaign ON public.contact_points USING btree (campaign_id);
CREATE INDEX facts_cell ON public.facts USING btree (cell_id, kind);
CREATE INDEX facts_value ON public.facts USING btree (kind, value);
CREATE INDEX impacts_largest ON public.impacts USING btree ("largest_N", campaign_id, whole);
CREATE INDEX impacts_recording ON public.impacts USING btree (recording_id);
CREATE INDEX impacts_whole ON public.impacts USING btree (whole, campaign_id, "largest_N");
CREATE INDEX maps_sha256 ON public.maps USING btree (sha256);
CREATE INDEX releases_cell ON public.releases USING btree (cell_id);
CREATE INDEX releases_map ON public.releases USING btree (map_sha256);
CREATE INDEX uses_campaign ON public.uses USING btree (campaign_id);
CREATE INDEX uses_impact ON public.uses USING btree (impact_id);
CREATE INDEX withdrawals_release ON public.withdrawals USING btree (release_id);
CREATE TRIGGER audit_follow BEFORE INSERT ON public.audit FOR EACH ROW EXECUTE FUNCTION public.forcemap_follow_audit();
CREATE TRIGGER audit_kept_row BEFORE DELETE OR UPDATE ON public.audit FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER audit_kept_statement BEFORE TRUNCATE ON public.audit FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER campaigns_follow BEFORE INSERT ON public.campaigns FOR EACH ROW EXECUTE FUNCTION public.forcemap_follow_campaigns();
CREATE TRIGGER campaigns_kept_row BEFORE DELETE OR UPDATE ON public.campaigns FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER campaigns_kept_statement BEFORE TRUNCATE ON public.campaigns FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER cells_follow BEFORE INSERT ON public.cells FOR EACH ROW EXECUTE FUNCTION public.forcemap_follow_cells();
CREATE TRIGGER cells_kept_row BEFORE DELETE OR UPDATE ON public.cells FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER cells_kept_statement BEFORE TRUNCATE ON public.cells FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER contact_points_follow BEFORE INSERT ON public.contact_points FOR EACH ROW EXECUTE FUNCTION public.forcemap_follow_contact_points();
CREATE TRIGGER contact_points_kept_row BEFORE DELETE OR UPDATE ON public.contact_points FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER contact_points_kept_statement BEFORE TRUNCATE ON public.contact_points FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER facts_follow BEFORE INSERT ON public.facts FOR EACH ROW EXECUTE FUNCTION public.forcemap_follow_facts();
CREATE TRIGGER facts_kept_row BEFORE DELETE OR UPDATE ON public.facts FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER facts_kept_statement BEFORE TRUNCATE ON public.facts FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER impacts_follow BEFORE INSERT ON public.impacts FOR EACH ROW EXECUTE FUNCTION public.forcemap_follow_impacts();
CREATE TRIGGER impacts_kept_row BEFORE DELETE OR UPDATE ON public.impacts FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER impacts_kept_statement BEFORE TRUNCATE ON public.impacts FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER maps_follow BEFORE INSERT ON public.maps FOR EACH ROW EXECUTE FUNCTION public.forcemap_follow_maps();
CREATE TRIGGER maps_kept_row BEFORE DELETE OR UPDATE ON public.maps FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER maps_kept_statement BEFORE TRUNCATE ON public.maps FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER recordings_follow BEFORE INSERT ON public.recordings FOR EACH ROW EXECUTE FUNCTION public.forcemap_follow_recordings();
CREATE TRIGGER recordings_kept_row BEFORE DELETE OR UPDATE ON public.recordings FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER recordings_kept_statement BEFORE TRUNCATE ON public.recordings FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER releases_follow BEFORE INSERT ON public.releases FOR EACH ROW EXECUTE FUNCTION public.forcemap_follow_releases();
CREATE TRIGGER releases_kept_row BEFORE DELETE OR UPDATE ON public.releases FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER releases_kept_statement BEFORE TRUNCATE ON public.releases FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER uses_follow BEFORE INSERT ON public.uses FOR EACH ROW EXECUTE FUNCTION public.forcemap_follow_uses();
CREATE TRIGGER uses_kept_row BEFORE DELETE OR UPDATE ON public.uses FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER uses_kept_statement BEFORE TRUNCATE ON public.uses FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER withdrawals_follow BEFORE INSERT ON public.withdrawals FOR EACH ROW EXECUTE FUNCTION public.forcemap_follow_withdrawals();
CREATE TRIGGER withdrawals_kept_row BEFORE DELETE OR UPDATE ON public.withdrawals FOR EACH ROW EXECUTE FUNCTION public.forcemap_keep();
CREATE TRIGGER withdrawals_kept_statement BEFORE TRUNCATE ON public.withdrawals FOR EACH STATEMENT EXECUTE FUNCTION public.forcemap_keep();
ALTER TABLE ONLY public.campaigns
    ADD CONSTRAINT campaigns_cell_id_fkey FOREIGN KEY (cell_id) REFERENCES public.cells(id);
ALTER TABLE ONLY public.campaigns
    ADD CONSTRAINT campaigns_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
ALTER TABLE ONLY public.cells
    ADD CONSTRAINT cells_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
ALTER TABLE ONLY public.contact_points
    ADD CONSTRAINT contact_points_campaign_id_fkey FOREIGN KEY (campaign_id) REFERENCES public.campaigns(id);
ALTER TABLE ONLY public.contact_points
    ADD CONSTRAINT contact_points_entry_fkey FOREIGN KEY (entry) REFERENCES public.audit(id);
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
